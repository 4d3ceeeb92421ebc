"""A real Blender, as the module bpy, with the extension installed from its zip."""

import os
import tempfile
from pathlib import Path

# Before Blender starts: it must not find the user's own files.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp()

import bpy
import pytest

DIST = Path(__file__).resolve().parents[1] / "dist"


@pytest.fixture(scope="session", autouse=True)
def extension():
    [zip_file] = DIST.glob("*.zip")
    bpy.ops.extensions.package_install_files(
        filepath=str(zip_file), repo="user_default", enable_on_install=True
    )
    assert hasattr(bpy.types, "UV_OT_flatten_anything")


@pytest.fixture(autouse=True)
def scene(extension):
    """An empty scene; add-ons stay."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    bpy.context.preferences.edit.use_global_undo = True
