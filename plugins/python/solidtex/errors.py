"""What goes wrong, by the status of solidtex.h; the message is the library's own."""


class Error(Exception):
    """Any of these."""


class InvalidArgument(Error, ValueError):
    """An argument is out of range or has the wrong shape; the message names it."""


class FileError(Error, OSError):
    """The model cannot be found or read."""


class ModelError(Error, ValueError):
    """The file was read but is no valid model; the message names the field or tensor."""


class OutOfMemory(Error, MemoryError):
    """The library was refused memory."""


class InternalError(Error, RuntimeError):
    """A fault of the library."""


class Cancelled(Error, RuntimeError):
    """The query was stopped."""
