# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator: from the faces in edit mode to their UVs, in the background."""

import math
from concurrent.futures import CancelledError

import bpy
import numpy as np

from . import meshes, packing

#: Seconds between two looks at a computation.
INTERVAL = 0.1

#: What is up in Blender.
UP = (0.0, 0.0, 1.0)

#: The options that are always in view.
FIRST = ("method", "distortion_bound", "only_selected", "other_faces")

#: The others, by the names of their groups.
GROUPS = {
    "Seams": ("use_seams", "mark_seams", "avoid_smooth", "hard_angle", "hide_seams", "symmetry"),
    "Charts": ("max_charts", "coverage_weight", "straighten", "upright"),
    "Packing": ("margin", "resolution", "stack"),
    "Density and Tiles": ("texel_density", "tiles"),
}

#: Those that do nothing where charts are packed together with those of other faces.
NOT_TOGETHER = GROUPS["Density and Tiles"]

#: What goes on to other handlers while it runs: looking around.
NAVIGATION = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "MOUSEMOVE", "WINDOW_DEACTIVATE"}

#: What begins so goes on, too: timers of others, trackpads and 3D mice.
PASSING = ("TIMER", "TRACKPAD", "NDOF")


class Task:
    """The triangles of all meshes as one, and the computation on them."""

    def __init__(self, parts, use_seams, **options):
        import flatten_anything

        self.parts = parts
        self.resolution = options["resolution"]
        self.first = np.cumsum([0] + [len(part.vertices) for part in parts])
        moved = list(zip(parts, self.first[:-1], strict=True))

        def joined(of):
            return np.concatenate([of(part) + np.uint32(at) for part, at in moved])

        self.job = flatten_anything.submit(
            packing.unwrapped,
            parts,
            np.concatenate([part.vertices for part in parts]),
            joined(lambda part: part.triangles),
            seams=joined(lambda part: part.seams) if use_seams else None,
            no_seams=joined(lambda part: part.spared),
            objects=np.repeat(np.arange(len(parts)), [len(part.triangles) for part in parts]),
            **options,
        )

    def status(self):
        """Return a line about how far it is."""
        now = self.job.progress
        if now is None:
            return "Flatten Anything: starting"
        of_parts = f", {now.parts_done} of {now.parts} parts" if now.parts > 1 else ""
        return f"Flatten Anything: {now.stage} {100 * now.fraction:.0f} %{of_parts} (Esc: cancel)"

    def write(self, mark_seams):
        """Write the UVs; return what the user has to know."""
        layout, uvs, other_uvs, warnings = self.job.result()
        if not all(meshes.is_unchanged(part) for part in self.parts):
            raise Changed("the mesh was changed meanwhile")
        crossed = at = other_at = 0
        for part, low, high in zip(self.parts, self.first[:-1], self.first[1:], strict=True):
            end, other_end = at + len(part.chosen), other_at + len(part.others)
            crossed += meshes.write_uvs(
                part,
                np.concatenate([part.chosen, part.others]),
                np.concatenate([uvs[at:end], other_uvs[other_at:other_end]]),
            )
            at, other_at = end, other_end
            if mark_seams:
                inside = (layout.seams >= low).all(axis=1) & (layout.seams < high).all(axis=1)
                meshes.mark_seams(part, layout.seams[inside].astype(np.int64) - int(low))
        if crossed:
            warnings.append(f"a seam crosses {crossed} faces, which may overlap others")
        return warnings

    def image(self):
        """Return a line about the image that a texel density takes, if it is not the given one."""
        layout, *_ = self.job.result()
        [pixels] = layout.report["finish"]["resolution"]
        return None if pixels == self.resolution else f"The image is to have {pixels} pixels a side"


class Changed(Exception):
    """The mesh is no longer what the layout is for."""


class UV_OT_flatten_anything(bpy.types.Operator):
    """Cut and flatten the faces into few charts, without overlaps and with little distortion"""

    bl_idname = "uv.flatten_anything"
    bl_label = "Flatten Anything"
    bl_options = {"REGISTER", "UNDO"}

    method: bpy.props.EnumProperty(
        name="Method",
        items=[
            ("auto", "Automatic", "Directly from the geometry"),
            ("direct", "Direct", "Cut, flatten and pack the mesh as it is, in seconds"),
            ("neural", "Neural", "Train the networks of Flatten Anything first: half a minute"),
        ],
        default="auto",
    )
    distortion_bound: bpy.props.FloatProperty(
        name="Distortion Bound",
        description="Mean symmetric Dirichlet energy; 4 is no distortion at all",
        default=4.1,
        min=4.001,
        soft_max=6.0,
        precision=3,
    )
    max_charts: bpy.props.IntProperty(
        name="Most Charts",
        description="Of each connected part; 0 for as many as the bound takes",
        default=0,
        min=0,
    )
    hide_seams: bpy.props.FloatProperty(
        name="Hide Seams",
        description="Cut where little is seen: in folds, behind parts that lie before others. At 1 "
        "a seam in full view costs thirty-one times as much as a hidden one. Higher makes longer "
        "seams",
        default=0.0,
        min=0.0,
        soft_max=2.0,
        subtype="FACTOR",
    )
    hard_angle: bpy.props.FloatProperty(
        name="Hard Angle",
        description="Cut all edges at which the surface turns by at least so much, as baked normal "
        "maps like it; 0 for none",
        default=0.0,
        min=0.0,
        max=math.pi,
        subtype="ANGLE",
    )
    symmetry: bpy.props.EnumProperty(
        name="Symmetry",
        description="Lay out mirror images as mirror images",
        items=[
            ("off", "Off", "Pay no heed to symmetry"),
            ("auto", "Automatic", "Find the plane of symmetry, whatever its direction"),
            ("x", "X", "Across the world's x axis"),
            ("y", "Y", "Across the world's y axis"),
            ("z", "Z", "Across the world's z axis"),
        ],
        default="off",
    )
    stack: bpy.props.EnumProperty(
        name="Stack",
        description="Let equal parts share their place in the square",
        items=[
            ("none", "None", "Every part has a place of its own"),
            ("identical", "Identical", "Parts that are equal share one"),
            (
                "mirrored",
                "Mirrored",
                "Mirror images as well, which are mirrored in the square then",
            ),
        ],
        default="none",
    )
    straighten: bpy.props.BoolProperty(
        name="Straighten",
        description="Make charts that are nearly rectangles or strips, such as pipes, straight "
        "along the axes, within the distortion bound",
        default=False,
    )
    upright: bpy.props.BoolProperty(
        name="Upright",
        description="Turn every chart so that the world's z axis is up in the image",
        default=False,
    )
    coverage_weight: bpy.props.FloatProperty(
        name="Fill Square",
        description="Divide long and hooked charts where the square is filled so much better that "
        "it pays for the seam. Higher divides more of them",
        default=0.0,
        min=0.0,
        soft_max=4.0,
        subtype="FACTOR",
    )
    texel_density: bpy.props.FloatProperty(
        name="Texel Density",
        description="Pixels per unit of length in the world. The image becomes as large as that "
        "takes, which is told; with several tiles, as many are filled as it takes. 0 for charts as "
        "large as they fit",
        default=0.0,
        min=0.0,
        soft_max=4096.0,
    )
    tiles: bpy.props.IntProperty(
        name="UDIM Tiles",
        description="Spread the charts over so many tiles of the image's size; with a texel "
        "density over so many at most",
        default=1,
        min=1,
        max=100,
    )
    margin: bpy.props.FloatProperty(
        name="Margin", description="Pixels between charts", default=4.0, min=0.0, soft_max=64.0
    )
    resolution: bpy.props.IntProperty(
        name="Image Size",
        description="Pixels along the side of the image that the margin is for",
        default=2048,
        min=16,
        max=65536,
        subtype="PIXEL",
    )
    use_seams: bpy.props.BoolProperty(
        name="Use Seams", description="Cut along all marked seams", default=True
    )
    avoid_smooth: bpy.props.BoolProperty(
        name="Avoid Smooth Edges",
        description="Cut edges that are neither sharp nor marked only where there is no other way",
        default=False,
    )
    only_selected: bpy.props.BoolProperty(
        name="Only Selected Faces", description="Unwrap no other faces", default=True
    )
    other_faces: bpy.props.EnumProperty(
        name="Other Faces",
        description="What becomes of the UVs of faces that are hidden or not selected",
        items=[
            (
                "keep",
                "Keep UVs",
                "They stay exactly as they are. The new charts fill the square, and may lie upon "
                "theirs",
            ),
            (
                "pack",
                "Pack Together",
                "Pack their charts and the new ones into one square, all at the same texel "
                "density. Their charts are moved, turned and scaled, and keep their shapes",
            ),
        ],
        default="keep",
    )
    mark_seams: bpy.props.BoolProperty(
        name="Mark Seams", description="Mark the edges that are cut as seams", default=False
    )

    @classmethod
    def poll(cls, context):
        return context.mode == "EDIT_MESH"

    @staticmethod
    def draw_options(properties, layout, names):
        together = properties.other_faces == "pack"
        for name in names:
            row = layout.row()
            row.enabled = not (together and name in NOT_TOGETHER)
            row.prop(properties, name)
        if together and not set(NOT_TOGETHER).isdisjoint(names):
            layout.label(text="Pack Together fills one square", icon="INFO")

    def draw(self, _context):
        # Sub-panels of Blender's are for panels only, not for the popup of F9.
        self.layout.use_property_split = True
        self.draw_options(self.properties, self.layout, FIRST)
        for title, names in GROUPS.items():
            self.layout.separator()
            self.layout.label(text=title)
            self.draw_options(self.properties, self.layout, names)

    def start(self, context):
        """Start the computation; None, with a report, if there is nothing to do."""
        together = self.other_faces == "pack"
        parts = meshes.parts(
            context.objects_in_mode_unique_data,
            self.only_selected,
            self.avoid_smooth,
            together,
        )
        if not parts:
            self.report({"ERROR"}, "No faces are selected")
            return None
        degrees = math.degrees(self.hard_angle)
        options = {
            "method": self.method,
            "distortion_bound": self.distortion_bound,
            "max_charts": self.max_charts or None,
            "hide_seams": self.hide_seams,
            # A float of Blender's is a little more than a straight angle.
            "hard_angle": min(degrees, 180.0) if degrees >= 1 else None,
            "symmetry": self.symmetry,
            "stack": self.stack,
            "straighten": self.straighten,
            "upright": UP if self.upright else None,
            "coverage_weight": self.coverage_weight,
            "texel_density": None if together else self.texel_density or None,
            "tiles": 1 if together else self.tiles,
            "margin": min(self.margin, self.resolution / 4),
            "resolution": self.resolution,
        }
        try:
            return Task(parts, self.use_seams, **options)
        except ImportError as error:
            self.report({"ERROR"}, f"The extension is not for this system: {error}")
            return None

    def end(self, task):
        """Write the result of a computation that has ended."""
        import flatten_anything

        try:
            warnings = task.write(self.mark_seams)
        except CancelledError:
            return {"CANCELLED"}
        except (Changed, flatten_anything.FlattenAnythingError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for warning in warnings:
            self.report({"WARNING"}, warning)
        if image := task.image():
            self.report({"INFO"}, image)
        return {"FINISHED"}

    def execute(self, context):
        """Wait for the result: from scripts and from the redo panel."""
        if self.method == "neural" and (self.options.is_repeat or self.options.is_repeat_last):
            self.report(
                {"ERROR"},
                "Blender would stand still during training: run it anew, or choose Direct",
            )
            return {"CANCELLED"}
        task = self.start(context)
        if task is None:
            return {"CANCELLED"}
        task.job.exception()
        return self.end(task)

    def invoke(self, context, _event):
        """Compute in the background."""
        image = getattr(context.space_data, "image", None)
        is_given = self.properties.is_property_set("resolution")
        if image is not None and image.size[0] >= 16 and not is_given:
            self.resolution = max(image.size)
        self._task = self.start(context)
        if self._task is None:
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set(self._task.status())
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self._task.job.cancel()
            return self.leave(context, {"CANCELLED"})
        if event.type == "TIMER":
            if self._task.job.done():
                try:
                    result = self.end(self._task)
                except BaseException:
                    self.leave(context, {"CANCELLED"})
                    raise
                return self.leave(context, result)
            context.workspace.status_text_set(self._task.status())
        passes = event.type in NAVIGATION or event.type.startswith(PASSING)
        return {"PASS_THROUGH"} if passes else {"RUNNING_MODAL"}

    def cancel(self, context):
        """Blender ends it: a file is loaded, or the window closes."""
        self._task.job.cancel()
        self.leave(context, {"CANCELLED"})

    def leave(self, context, result):
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        return result


def register():
    bpy.utils.register_class(UV_OT_flatten_anything)


def unregister():
    bpy.utils.unregister_class(UV_OT_flatten_anything)
