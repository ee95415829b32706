"""Errors a user can mend: what is wrong, what was given, what to do."""


class PerspSWError(Exception):
    """Base of every error this program raises on purpose; the command line exits with 2 on it."""


class VolumeError(PerspSWError):
    """An array, spacing or pose that cannot be a volume."""


class FileError(PerspSWError):
    """A file that is missing, truncated, of the wrong kind or not supported."""


class TraceError(FileError):
    """A trace that cannot be written or read."""


class TransferFunctionError(PerspSWError):
    """Control points that do not make a transfer function."""


class LookError(PerspSWError):
    """Lights, or anything else of a look, that cannot be."""


class ViewError(PerspSWError):
    """An eye, wall or view that cannot be rendered."""


class SettingsError(PerspSWError):
    """A setting outside its range."""


class SceneError(PerspSWError):
    """A scene file with problems; the message lists all of them."""


class MissingPackageError(PerspSWError):
    """An optional package is needed; the message says which extra brings it."""


class GraphicsError(PerspSWError):
    """OpenGL that is absent, too old or not what was asked of it."""
