# SPDX-License-Identifier: GPL-3.0-or-later
"""Where users find it: in the menu UV > Unwrap and in the sidebar of the UV editor."""

import bpy

from .operator import UV_OT_flatten_anything


def draw_in_menu(self, _context):
    self.layout.separator()
    self.layout.operator(UV_OT_flatten_anything.bl_idname)


class IMAGE_PT_flatten_anything(bpy.types.Panel):
    bl_label = "Flatten Anything"
    bl_space_type = "IMAGE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Flatten Anything"

    @classmethod
    def poll(cls, context):
        return context.mode == "EDIT_MESH"

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.operator_context = "INVOKE_DEFAULT"
        last = context.window_manager.operator_properties_last(UV_OT_flatten_anything.bl_idname)
        if last is not None:
            UV_OT_flatten_anything.draw_options(last, self.layout)
        self.layout.operator(UV_OT_flatten_anything.bl_idname)


def register():
    bpy.utils.register_class(IMAGE_PT_flatten_anything)
    bpy.types.IMAGE_MT_uvs_unwrap.append(draw_in_menu)
    bpy.types.VIEW3D_MT_uv_map.append(draw_in_menu)


def unregister():
    bpy.types.VIEW3D_MT_uv_map.remove(draw_in_menu)
    bpy.types.IMAGE_MT_uvs_unwrap.remove(draw_in_menu)
    bpy.utils.unregister_class(IMAGE_PT_flatten_anything)
