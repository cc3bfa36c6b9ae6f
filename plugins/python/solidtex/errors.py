"""Exceptions of the package, one for each status of solidtex.h."""


class Error(Exception):
    """Base class of all exceptions."""


class InvalidArgument(Error, ValueError):
    """An argument is out of range or has the wrong shape. The message names it."""


class FileError(Error, OSError):
    """The model cannot be found or read."""


class ModelError(Error, ValueError):
    """The file is not a valid model. The message names the field or tensor."""


class OutOfMemory(Error, MemoryError):
    """Memory is short."""


class InternalError(Error, RuntimeError):
    """The library has a bug."""


class Cancelled(Error, RuntimeError):
    """The query was cancelled."""


class Unavailable(Error, RuntimeError):
    """An optional library is missing. The message names it."""
