#!/bin/sh
# OpenGL without a screen (Mesa's EGL) and a virtual screen (Xvfb), for the tests that draw with OpenGL.
# Installs what is missing where we may; otherwise says in one line what to install. Never fatal unless CI=true,
# where tests must not be skipped.
packages="libegl1 libgl1 libgl1-mesa-dri xvfb xdotool"

missing=""
libraries=$(ldconfig -p 2>/dev/null || /sbin/ldconfig -p 2>/dev/null)
for library in libEGL.so.1:libegl1 libGL.so.1:libgl1 libEGL_mesa.so.0:libegl-mesa0; do
    case "$libraries" in
        *"${library%%:*}"*) ;;
        *) missing="$missing ${library##*:}" ;;
    esac
done
command -v Xvfb >/dev/null 2>&1 || missing="$missing xvfb"
command -v xdotool >/dev/null 2>&1 || missing="$missing xdotool"
[ -z "$missing" ] && exit 0

if command -v apt-get >/dev/null 2>&1; then
    if [ "$(id -u)" = 0 ]; then
        as_root=""
    elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
        as_root="sudo -n"
    else
        as_root="no"
    fi
    if [ "$as_root" != no ]; then
        echo "installing$missing"
        install="$as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y --no-install-recommends install $packages"
        $install >/dev/null 2>&1 </dev/null && exit 0
        $as_root apt-get -qq update >/dev/null 2>&1 </dev/null
        $install >/dev/null 2>&1 </dev/null && exit 0
    fi
fi
echo "warning: OpenGL tests will be skipped; missing:$missing (Debian names). Install: apt-get install $packages" >&2
[ "$CI" = true ] && exit 1
exit 0
