"""A window of WebKitGTK for its WebDriver: `python webkit_window.py WIDTH HEIGHT`.

MiniBrowser does the same, but on Broadway it takes the unknown resolution of the screen, -1, for a scale.
"""

import ctypes
import sys
from ctypes import CFUNCTYPE, c_char_p, c_double, c_int, c_size_t, c_void_p

_GOBJECT, _GDK, _GTK, _WEBKIT = map(
    ctypes.CDLL, ("libgobject-2.0.so.0", "libgdk-3.so.0", "libgtk-3.so.0", "libwebkit2gtk-4.1.so.0")
)
_TOP_LEVEL = 0


def _call(library: ctypes.CDLL, name: str, *given: object, gives: type | None = c_void_p) -> int:
    """Call a function; what it is given are ctypes' values."""
    function = library[name]
    function.restype = gives
    return function(*given)  # type: ignore[no-any-return]


def _connect(thing: int, signal: bytes, callback: object) -> None:
    pointer = ctypes.cast(callback, c_void_p)  # type: ignore[arg-type]
    _call(_GOBJECT, "g_signal_connect_data", c_void_p(thing), c_char_p(signal), pointer, None, None, c_int(0))


@CFUNCTYPE(c_void_p, c_void_p, c_void_p)
def _create(_session: int, _data: int) -> int:
    kind = c_size_t(_call(_WEBKIT, "webkit_web_view_get_type", gives=c_size_t))
    view = c_void_p(_call(_GOBJECT, "g_object_new", kind, b"is-controlled-by-automation", c_int(1), None))
    settings = c_void_p(_call(_WEBKIT, "webkit_web_view_get_settings", view))
    _call(_GOBJECT, "g_object_set", settings, b"enable-write-console-messages-to-stdout", c_int(1), None)
    window = c_void_p(_call(_GTK, "gtk_window_new", c_int(_TOP_LEVEL)))
    _call(_GTK, "gtk_window_set_default_size", window, *(c_int(int(size)) for size in sys.argv[1:3]))
    _call(_GTK, "gtk_container_add", window, view)
    _call(_GTK, "gtk_widget_show_all", window)
    return view.value or 0


@CFUNCTYPE(None, c_void_p, c_void_p, c_void_p)
def _started(_context: int, session: int, _data: int) -> None:
    _connect(session, b"create-web-view", _create)


if __name__ == "__main__":
    _call(_GTK, "gtk_init", None, None)
    screen = c_void_p(_call(_GDK, "gdk_screen_get_default"))
    _call(_GDK, "gdk_screen_set_resolution", screen, c_double(96.0))
    context = _call(_WEBKIT, "webkit_web_context_get_default")
    _call(_WEBKIT, "webkit_web_context_set_automation_allowed", c_void_p(context), c_int(1))
    _connect(context, b"automation-started", _started)
    _call(_GTK, "gtk_main")
