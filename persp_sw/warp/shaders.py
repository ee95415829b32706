"""The shaders of the texture warp, OpenGL 3.3."""

from __future__ import annotations

MOST_FACES = 6
MOST_CORNERS = 8
MOST_PLANES = 16  # further ones are left out: the depth is then the middle of a longer piece of the ray

_HEADER = "#version 330 core\n"

# The outline is without depth: no near or far plane clips it, and the depth is each fragment's own.
_VERTEX = f"""
uniform vec2 outline[{MOST_CORNERS}];
out vec2 ndc;

void main() {{
    ndc = outline[gl_VertexID];
    gl_Position = vec4(ndc, 0.0, 1.0);
}}
"""

# Depth that OpenGL would give clip-space z and w, but clamped to the range and never clipped.
_DEPTH = """
uniform vec2 window_from_depth;  // scale and offset of z / w; the range follows

float window_depth(vec2 zw) {
    float depth = zw.y > 0.0 ? zw.x / zw.y * window_from_depth.x + window_from_depth.y : 0.0;
    return clamp(depth, 0.0, 1.0) * gl_DepthRange.diff + gl_DepthRange.near;
}
"""

# Each fragment asks every face where its ray meets it, and mixes those whose own it is or nearly is as
# `geometry.seams` says. Its depth is that of the face on which the ray is nearest to the middle.
_FACES = f"""
const float SLACK = 1.0 / 512.0;  // pixels of rounding
const float EVERYWHERE = 1e30;

in vec2 ndc;
out vec4 colour;
uniform sampler2DArray texels;
uniform mat3 face_from_ndc[{MOST_FACES}];
uniform vec2 last[{MOST_FACES}];     // size − 1
#ifdef FACES
uniform vec2 middle[{MOST_FACES}];   // tangents
uniform float pitch, alone;          // alone: c of the seams
#endif
#ifdef DEPTH
#ifdef PARALLEL
uniform mat3 start_from_face;
#endif
uniform mat3 object_from_face[{MOST_FACES}];
uniform vec3 low, high;              // the box, relative to where rays start
uniform int planes;
uniform vec4 plane[{MOST_PLANES}];
uniform mat3 world_from_object;
uniform float nearest;               // world distance
uniform mat4x2 depth_from_object;

// Clip z, w half-way on the piece of the ray that the colour comes from.
vec2 middle_of_ray(vec3 start, vec3 along) {{
    along = mix(along, vec3(1e-9), lessThan(abs(along), vec3(1e-9)));
    vec3 one = (low - start) / along, other = (high - start) / along;
    vec3 enter = min(one, other), leave = max(one, other);
    float from = max(max(enter.x, enter.y), enter.z), to = min(min(leave.x, leave.y), leave.z);
#ifdef NEAR
    from = max(from, nearest / length(world_from_object * along));
#endif
#ifdef PLANES
    for (int n = 0; n < planes; n++) {{
        float slope = dot(plane[n].xyz, along), at = -(dot(plane[n].xyz, start) + plane[n].w) / slope;
        if (slope > 0.0) from = max(from, at);
        else if (slope < 0.0) to = min(to, at);
    }}
#endif
    return depth_from_object * vec4(start + 0.5 * (from + to) * along, 1.0);
}}
#endif

// What a face shows at a place, its pixels counted from its middle; nothing outside of it.
bool look_up(int face, vec2 place, out vec4 found) {{
    vec2 size = last[face], at = place + 0.5 * size;
    found = vec4(0.0);
    if (any(lessThan(at, vec2(-SLACK))) || any(greaterThan(at, size + SLACK))) return false;
#ifdef EXACT
    // A texture unit's own filter has weights of 8 bits on most hardware.
    at = clamp(at, vec2(0.0), size);
    vec2 corner = min(floor(at), size - 1.0), share = at - corner;
    ivec3 texel = ivec3(corner, face);
    vec4 above = mix(texelFetch(texels, texel, 0), texelFetch(texels, texel + ivec3(1, 0, 0), 0), share.x);
    vec4 under = mix(texelFetch(texels, texel + ivec3(0, 1, 0), 0),
                     texelFetch(texels, texel + ivec3(1, 1, 0), 0), share.x);
    found = mix(above, under, share.y);
#else
    vec2 texture_size = vec2(textureSize(texels, 0).xy);
    found = textureLod(texels, vec3((clamp(at, vec2(0.0), size) + 0.5) / texture_size, face), 0.0);
#endif
    return true;
}}

void main() {{
    int face = 0;
    bool shown = false;
    vec4 found;
#ifdef FACES
    float best = EVERYWHERE, total = 0.0;
    vec2 place = vec2(0.0);
    colour = vec4(0.0);
    for (int n = 0; n < FACES; n++) {{
        vec3 point = face_from_ndc[n] * vec3(ndc, 1.0);
        if (!(point.z > 0.0)) continue;
        vec2 there = point.xy / point.z, tangents = abs(middle[n] + pitch * there);
        float steepest = max(tangents.x, tangents.y);
        float counts = 1.0 / max(steepest, 1.0) - alone;
        if (steepest < best) {{ best = steepest; face = n; place = there; }}
        if (counts > 0.0 && look_up(n, there, found)) {{
            shown = true;
            colour += counts * found;
            total += counts;
        }}
    }}
    if (shown) colour /= total;
#else
    vec3 point = face_from_ndc[0] * vec3(ndc, 1.0);
    vec2 place = point.xy / point.z;
    if (point.z > 0.0) shown = look_up(0, place, found);
    colour = found;
#endif
    if (!shown) discard;
#ifdef DEPTH
    vec3 where = vec3(place, 1.0), start = vec3(0.0);
#ifdef PARALLEL
    start = start_from_face * where;
#endif
    gl_FragDepth = window_depth(middle_of_ray(start, object_from_face[face] * where));
#endif
}}
"""

_PICTURE = """
in vec2 ndc;
out vec4 colour;
uniform sampler2D picture;
#ifdef DEPTH
uniform float clip_depth;
#endif

void main() {
    ivec2 size = textureSize(picture, 0);
    vec2 at = vec2(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y);  // row 0 on top
    colour = texelFetch(picture, clamp(ivec2(floor(at * vec2(size))), ivec2(0), size - 1), 0);
#ifdef DEPTH
    gl_FragDepth = window_depth(vec2(clip_depth, 1.0));
#endif
}
"""


def face_sources(options: frozenset[str]) -> tuple[str, str]:
    """Vertex and fragment shader that draw faces of an eye image.

    Options: "FACES n" if there are several; PARALLEL rays; EXACT filtering in float32; DEPTH of each ray
    (else none), with a NEAR distance and PLANES of regions if there are.
    """
    return _HEADER + _VERTEX, _source(_FACES, options)


def picture_sources(options: frozenset[str]) -> tuple[str, str]:
    """Vertex and fragment shader that draw a picture as it is; option DEPTH: at one depth."""
    return _HEADER + _VERTEX, _source(_PICTURE, options)


def _source(body: str, options: frozenset[str]) -> str:
    defines = "".join(f"#define {name}\n" for name in sorted(options))
    return _HEADER + defines + (_DEPTH if "DEPTH" in options else "") + body
