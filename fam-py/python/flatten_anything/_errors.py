"""What can go wrong. Every message is one line, the same that the program `fam` prints."""


class FlattenAnythingError(Exception):
    """Any error of this package."""


class InputError(FlattenAnythingError, ValueError):
    """The arrays or the options make no sense."""


class FileError(FlattenAnythingError, OSError):
    """A file cannot be read or written."""


class TrainingError(FlattenAnythingError, RuntimeError):
    """Training failed from the first step on."""


class Cancelled(FlattenAnythingError):
    """The computation was cancelled."""


class InternalError(FlattenAnythingError, RuntimeError):
    """A fault of this package; please report it."""
