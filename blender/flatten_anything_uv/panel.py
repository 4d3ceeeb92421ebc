# SPDX-License-Identifier: GPL-3.0-or-later
"""Where users find it: in the menu UV > Unwrap and in the sidebar of the UV editor."""

import bpy

from .operator import FIRST, GROUPS, UV_OT_flatten_anything


def draw_in_menu(self, _context):
    self.layout.separator()
    self.layout.operator(UV_OT_flatten_anything.bl_idname)


class Place:
    """Where the panel and its parts are."""

    bl_space_type = "IMAGE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Flatten Anything"

    @classmethod
    def poll(cls, context):
        return context.mode == "EDIT_MESH"


class IMAGE_PT_flatten_anything(Place, bpy.types.Panel):
    bl_label = "Flatten Anything"

    def draw(self, context):
        self.layout.operator_context = "INVOKE_DEFAULT"
        self.layout.operator(UV_OT_flatten_anything.bl_idname)
        draw_options(self.layout, context, FIRST)


def draw_options(layout, context, names):
    layout.use_property_split = True
    last = context.window_manager.operator_properties_last(UV_OT_flatten_anything.bl_idname)
    if last is not None:
        UV_OT_flatten_anything.draw_options(last, layout, names)


def part(title, names):
    """Return a part of the panel that is closed at first."""
    content = {
        "bl_label": title,
        "bl_parent_id": IMAGE_PT_flatten_anything.__name__,
        "bl_options": {"DEFAULT_CLOSED"},
        "draw": lambda self, context: draw_options(self.layout, context, names),
    }
    name = f"{IMAGE_PT_flatten_anything.__name__}_{title.lower().replace(' ', '_')}"
    return type(name, (Place, bpy.types.Panel), content)


PANELS = (IMAGE_PT_flatten_anything, *(part(*group) for group in GROUPS.items()))


def register():
    for panel in PANELS:
        bpy.utils.register_class(panel)
    bpy.types.IMAGE_MT_uvs_unwrap.append(draw_in_menu)
    bpy.types.VIEW3D_MT_uv_map.append(draw_in_menu)


def unregister():
    bpy.types.VIEW3D_MT_uv_map.remove(draw_in_menu)
    bpy.types.IMAGE_MT_uvs_unwrap.remove(draw_in_menu)
    for panel in reversed(PANELS):
        bpy.utils.unregister_class(panel)
