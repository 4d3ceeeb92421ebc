# SPDX-License-Identifier: GPL-3.0-or-later
"""UV > Unwrap > Flatten Anything."""

from . import operator, panel


def register():
    operator.register()
    panel.register()


def unregister():
    panel.unregister()
    operator.unregister()
