"""OpenGL without a screen (EGL).

EGL is called through ctypes: PyOpenGL is bound to one window system, the one it found when it was first
imported, and a program may have windows as well.
"""

from __future__ import annotations

import ctypes
import os
import sys
from functools import cache
from types import ModuleType
from typing import Any

from ..errors import GraphicsError, MissingPackageError

_ADVICE = "on Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri; or take the software warp"
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software")
_MOST_DEVICES = 16

# Names and values of EGL 1.5 and its extensions device_base, platform_device and MESA_platform_surfaceless.
_PLATFORM_DEVICE, _PLATFORM_SURFACELESS = 0x313F, 0x31DD
_OPENGL_API, _NONE = 0x30A2, 0x3038
_CONFIG = (0x3033, 0, 0x3040, 0x0008, _NONE)  # surface type: any; renderable type: OpenGL
_CORE_3_3 = (0x3098, 3, 0x30FB, 3, 0x30FD, 1, _NONE)  # major and minor version, core profile

_P, _INT, _UINT = ctypes.c_void_p, ctypes.c_int, ctypes.c_uint
_FUNCTIONS = {  # result and arguments
    "eglGetProcAddress": (_P, ctypes.c_char_p),
    "eglInitialize": (_UINT, _P, _P, _P),
    "eglBindAPI": (_UINT, _UINT),
    "eglChooseConfig": (_UINT, _P, _P, _P, _INT, _P),
    "eglCreateContext": (_P, _P, _P, _P, _P),
    "eglDestroyContext": (_UINT, _P, _P),
    "eglMakeCurrent": (_UINT, _P, _P, _P, _P),
    "eglGetCurrentContext": (_P,),
    "eglGetCurrentDisplay": (_P,),
    "eglGetCurrentSurface": (_P, _INT),
    "eglGetError": (_INT,),
}
_DRAW, _READ = 0x3059, 0x305A


@cache
def opengl() -> ModuleType:
    """PyOpenGL's functions, `OpenGL.GL`.

    Raises
    ------
    MissingPackageError
        No PyOpenGL, or no OpenGL library that it finds.
    """
    screen = any(name in os.environ for name in ("DISPLAY", "WAYLAND_DISPLAY", "PYOPENGL_PLATFORM"))
    on_egl = sys.platform == "linux" and not screen and "OpenGL" not in sys.modules
    if on_egl:
        os.environ["PYOPENGL_PLATFORM"] = "egl"
    try:
        from OpenGL import GL
    except (ImportError, AttributeError, OSError) as error:  # AttributeError: a platform without its library
        raise MissingPackageError(
            f"the texture warp needs PyOpenGL and OpenGL ({error}): pip install 'persp-sw[view]'; {_ADVICE}"
        ) from None
    finally:
        if on_egl:  # child processes choose for themselves
            del os.environ["PYOPENGL_PLATFORM"]
    return GL


@cache
def _raw() -> ModuleType:
    opengl()
    from OpenGL.raw.GL.VERSION import GL_1_0

    return GL_1_0


def integers(name: int, count: int = 1) -> list[int]:
    """`count` whole numbers of OpenGL's state, five times as fast as PyOpenGL's own: a draw asks for 25."""
    values = (_INT * 16)()
    _raw().glGetIntegerv(name, values)
    return values[:count]


class OffscreenContext:
    """An OpenGL 3.3 core context that needs no screen; current as soon as it is made.

    Parameters
    ----------
    share
        A context whose textures, buffers and programs this one is to share.
    device
        Number of the graphics device, in EGL's order; None takes the first that works.

    As a context manager it closes itself in the end. It has no framebuffer of its own: see `Framebuffer`.

    Attributes
    ----------
    renderer
        OpenGL's name for what draws: a graphics card, or a software rasteriser such as llvmpipe.

    Raises
    ------
    MissingPackageError
        No PyOpenGL.
    GraphicsError
        No EGL, no OpenGL 3.3 behind it, or a window's context is current, which must be released first.
    """

    def __init__(self, share: OffscreenContext | None = None, device: int | None = None):
        gl = opengl()
        self._egl = _load_egl()
        self._before = _current(self._egl)
        self._context: int | None = None
        if share is not None:
            self._display = share._display
            self._context = self._create(self._display, share._context)
        else:
            self._display = self._first_display(device)
        try:
            self.make_current()
            self.renderer: str = gl.glGetString(gl.GL_RENDERER).decode(errors="replace")
        except BaseException:
            self.close()
            raise

    @property
    def is_software(self) -> bool:
        """Whether the processor draws, not a graphics card."""
        return any(name in self.renderer.lower() for name in _SOFTWARE)

    def make_current(self) -> None:
        """Make it this thread's current context.

        Raises
        ------
        GraphicsError
            It was closed, or is current in another thread, or a window's context is current in this one.
        """
        if self._context is None:
            raise GraphicsError("this offscreen context was closed; make another")
        if not self._egl.eglMakeCurrent(self._display, None, None, self._context):
            raise GraphicsError(
                f"cannot make the offscreen context current (EGL error {self._egl.eglGetError():#x}): release"
                " the window's context, or this one in its other thread, first"
            )

    def release(self) -> None:
        """Let no context be current in this thread, so that a window's can be."""
        self._egl.eglMakeCurrent(self._display, None, None, None)

    def close(self) -> None:
        """Destroy the context and what only it had; where it was current, the one before it is again."""
        if self._context is None:
            return
        context, self._context = self._context, None
        display, draw, read, before = self._before
        if self._egl.eglGetCurrentContext() == context:
            self._egl.eglMakeCurrent(self._display, None, None, None)
            if before:  # may have been destroyed since: then there is none
                self._egl.eglMakeCurrent(display, draw, read, before)
        self._egl.eglDestroyContext(self._display, context)

    def __enter__(self) -> OffscreenContext:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _first_display(self, device: int | None) -> int:
        """The display of the first device on which a context can be made; makes it."""
        for display in _displays(self._egl, device):
            if display and self._egl.eglInitialize(display, None, None):
                self._context = self._create(display, None, must=False)
                if self._context:
                    return display
        which = "" if device is None else f" on graphics device {device}"
        raise GraphicsError(f"EGL offers no OpenGL 3.3 core context{which}: {_ADVICE}")

    def _create(self, display: int, share: int | None, must: bool = True) -> int | None:
        config, count = _P(), _INT()
        self._egl.eglBindAPI(_OPENGL_API)
        wanted = (_INT * len(_CONFIG))(*_CONFIG)
        self._egl.eglChooseConfig(display, wanted, ctypes.byref(config), 1, ctypes.byref(count))
        context = None
        if count.value:
            attributes = (_INT * len(_CORE_3_3))(*_CORE_3_3)
            context = self._egl.eglCreateContext(display, config, share, attributes)
        if must and not context:
            error = self._egl.eglGetError()
            raise GraphicsError(f"no context that shares with this one can be made (EGL error {error:#x})")
        return context


@cache
def _load_egl() -> Any:
    """libEGL, its functions' types declared."""
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # Mesa tells of every graphics device it cannot use
    for name in ("libEGL.so.1", "libEGL.so", "libEGL.dll", "libEGL.dylib"):
        try:
            egl = ctypes.CDLL(name)
        except OSError:
            continue
        for function, (result, *arguments) in _FUNCTIONS.items():
            getattr(egl, function).restype, getattr(egl, function).argtypes = result, arguments
        return egl
    raise GraphicsError(f"an offscreen context needs EGL, which is not installed: {_ADVICE}")


def _displays(egl: Any, device: int | None):
    """EGL displays that need no screen: each graphics device's, then that of none."""

    def function(name: bytes, *types: Any) -> Any:
        address = egl.eglGetProcAddress(name)
        return ctypes.CFUNCTYPE(*types)(address) if address else None

    query = function(b"eglQueryDevicesEXT", _UINT, _INT, _P, _P)
    display = function(b"eglGetPlatformDisplayEXT", _P, _UINT, _P, _P)
    if display is None:
        return
    devices, count = (_P * _MOST_DEVICES)(), _INT()
    if query is not None:
        query(_MOST_DEVICES, devices, ctypes.byref(count))
    for number in range(count.value):
        if device in (None, number):
            yield display(_PLATFORM_DEVICE, devices[number], None)
    if device is None:
        yield display(_PLATFORM_SURFACELESS, None, None)


def _current(egl: Any) -> tuple[Any, Any, Any, Any]:
    """What is current in this thread: display, surfaces to draw to and read from, context."""
    egl.eglBindAPI(_OPENGL_API)
    surfaces = egl.eglGetCurrentSurface(_DRAW), egl.eglGetCurrentSurface(_READ)
    return egl.eglGetCurrentDisplay(), *surfaces, egl.eglGetCurrentContext()
