"""Named tolerances, each with the line of reasoning that gives it."""

# --- Reference ray caster and exact pictures ---------------------------------------------------------------

# Rays are cut and lengths summed in float64: about 1e3 operations on numbers below 1e3, 1e-16 each.
ROUNDING = 1e-10

# A ramp's voxels are exact; what is left is the rule's error, for which the test asks 1e-10 summed per ray.
REFERENCE_AT_1E_10 = 1e-9

# The ball's bounds are rigorous for exact arithmetic, and allow for float32 voxels themselves.
BALL_BOUND = ROUNDING

# Trilinear interpolation lowers the ball's value by O(h²), which moves the surface by O(h²); the picture's
# mean error follows. Four refinements fit the slope to about 0.2: the voxels' phase at the rim varies.
BALL_ORDER = 1.8

# A midpoint sum of N samples over a path of L and extinctions below τ errs by (steps crossed)·τ·L/N where the
# transfer function steps: 10 · 0.7 · 10 / 4e5 = 2e-4; with kinks only, by (kinks)·slope·(L/N)² < 1e-7.
MIDPOINT_STEPS = 2e-4
MIDPOINT_KINKS = 1e-7

# A marker is a tent of ±1 voxel, variance 1/6 voxel² along each axis. At distance D (voxels) perspective
# moves its centroid by about 3·f·tan θ·(1/6)/D² pixels: f = 400, tan θ = 0.25, D = 45 gives 0.025; a pixel
# lattice of 5 pixels a voxel integrates the tent's kinks to 0.01.
MARKER_PIXELS = 0.05

# Differences of values below 1e3 by 0.5 voxel and more, times a pose's inverse of up to 3: 1e-16 · 1e3 · 6,
# and a few operations of that size.
GRADIENT = 1e-11
# sin(k·r) / (k·r) with k·r up to 0.12 · 4: the next term is (k·r)² / 20 = 0.012 of the first.
GRADIENT_ORDER = 0.02

# Two pictures within 1e-9, each the sum over pieces of what is asked for.
LIT_AT_1E_9 = 2e-9
# A surface's light comes from the first 1e-5 world units of the ray: 13.8 of extinction to 1e-4. Normals turn
# by 1e-5 / 8, highlights of power 30 by 30 times as much, a light's cosines by no more; brightness below 4.
LIT_SURFACE = 2e-4
# As MIDPOINT_STEPS, with 1e5 samples: 10 steps of extinction 0.7, brightness up to 2, on 14 units, and
# as many of colour where normals turn over; half of a sample each, of either sign.
MIDPOINT_LIT = 1e-3

# Rays of 14 units and shadows of up to 10 in steps h of 0.035 and 0.083, on functions without steps, whose
# extinction bends some ten times by up to 0.7 a unit: 10 · 0.7 · 0.083² / 8 / 3 (of either sign) = 2e-3.
MIDPOINT_SHADOW = 2e-3
# Voxels. A ball of radius 4, interpolated, lies up to ¾ / (2 · 4) within the true one, its shadow as well.
SHADOW_EDGE = 0.15

# --- Shadows -----------------------------------------------------------------------------------------------

# Sums of up to 7³ float64 products of float32 table entries, rounded to float32 once.
SHADOW_COARSE = 2e-7
# Of up to 9 slices: what leaves one is rounded to float32, 6e-8, twice, and weights are sums of that size.
SHADOW_SWEEP = 2e-6
# Half of 1/65535, and as above.
SHADOW_BYTES = 0.5 / 65535 + 2e-6
# A voxel in fog that lets e^(−0.2) pass, beside a clear side, whose weights sum up to 2: of the difference to
# it, 0.18, it takes 2 · 0.18⁴.
SHADOW_BESIDE = SHADOW_BYTES + 2 * 0.1813**5
# Mean over 8³ voxels with a depth of 0.2 each: a slanted light is carried on from voxel to voxel, which is
# the walk of w and 1 − w that widens by √(w·(1 − w)) ≤ ½ voxel a slice; within that of the sides, 1.4 voxels
# after 8 slices, a tenth of the volume on each of two sides, light is too bright by an eighth at most.
SHADOW_SPREAD = 0.1 * 2 / 8
# Three interpolations of float32 (places in a row up to 150 · 6e-8 off, neighbours 1 apart), 6e-8 each.
SHADOW_LOOK_UP = 2e-5
# Voxels. A slanted border fades over a voxel: its mean over the light's way is right to 1/8 · the slope
# (0.36) between two voxels, 0.045.
SHADOW_FADE = 0.05
# Voxels of two, on balls of radius 5, whose light falls by up to a third a voxel: tents of two voxels blur
# by their variance, 2/3 of a voxel², times half the second difference, 1/3 of that fall, and some more where
# the light is carried on: 0.13 measured, and a tenth of it on average.
SHADOW_FACTOR = 0.15
# Rms of pictures: soft edges of shadows, a tenth of the pixels, where light is off by a tenth of what the
# lights bring, 0.1 · 0.1 · √0.1.
SHADOW_PICTURE = 3e-3
# Of a surface that fades out over 3/40 of a voxel, tents and interpolation leave less than e^(−3.5) in the
# way of a light that starts two voxels out; with twice the voxels rims of shadows are as much softer.
SHADOW_OWN = 0.05
# Of a light that nothing is in the way of: rounding of two neighbours to 1/65535.
SHADOW_STEP = 2 / 65535
# Rms from the light to the terminator, π/2 away. Light of cosine c starts 2·c voxels above a surface; below ¼
# of one it is carried on beside voxels inside, and half of it is lost: √(∫ (c/2)² dc / (π/2)) up to c = 1/8.
SHADOW_GRAZED = 0.0102
# Voxels: half of a shadow's edge after 9 slices, √(9 / 4), and half a voxel for tents.
SHADOW_SOFT = 2.0

# --- Metrics -----------------------------------------------------------------------------------------------

# Sums of a few thousand float64 numbers of order 1.
METRIC = 1e-12

# --- Compositing -------------------------------------------------------------------------------------------

# Alpha errs by float32 rounding, 6e-8 a slice, and depths, counted from the volume's front, by 6e-8 of the
# interval they are in: a dozen slices give 1e-6.
CLOSED_FORM = 2e-6

# As COMPOSITE_TWIN. Normals of float32 differences of values below 256 err by 6e-8 · 256 / |g|, here 1e-5
# where the gradient is a grey level a voxel; highlights of power 50 by 50 times as much, of one of some dozen
# samples.
LIT_TWIN = 2e-4
# A factor of 1 and a few roundings of 6e-8 of colours up to 2; a turned pose moves samples by 1e-6 voxels.
FLOAT32_LIT = 2e-5

# Kernel in float32, twin in float64: a look-up may fall on the neighbouring table entry, which differs by
# (0.5 opacity / 255 values) / 8 entries a value = 2.5e-4 of extinction for 8-bit data, in few samples.
COMPOSITE_TWIN = 3e-4

# The colours of a pre-integrated piece are taken from up to two of the 1024 steps of extinction too many,
# which moves their mean by half of that, through colours that differ by at most 1.
PREINTEGRATED_COLOUR = 1e-3

# Two pre-integrated samples, one of whose ends may fall on the next row: of two rows or more, the mean
# changes by less than half of the test's steepest step, 0.51 of extinction / 5 values / 8 rows = 0.013,
# times 1/2.
PREINTEGRATED_KERNELS = 0.01

# Two float32 computations of the same image in another order: a few dozen roundings of 6e-8 …
# and, rarely, the neighbouring table entry, as above.
FLOAT32_IMAGE = 3e-4

# A border between two parts, c from a sample's slice, moves the look-up of the piece beyond it, ½ − c long,
# by up to c: c·(½ − c) ≤ 1/16. The test's extinction varies by up to 0.14 a voxel, a ray is up to 1.7 an
# interval: 0.14 · 1.7 / 16 = 0.015, were all at its worst in one ray; a third of it for slope, slant and
# transparency that are not.
BORDER_SMOOTH = 0.005

# --- Geometry and warp ------------------------------------------------------------------------------------

# Products of a handful of float64 matrices with condition numbers up to 1e4, relative to their largest entry.
MATRIX = 1e-10

# float32 tangents below 4 in the face, interpolated in float32: a few roundings of 4 · 6e-8.
WARP_LINEAR = 2e-6

# Bilinear weights of float32 (positions of up to a few hundred pixels are float64) on values in 0 … 1.
WARP_TWIN = 1e-6

# --- Texture warp -----------------------------------------------------------------------------------------

# Places in a face, up to 150 pixels from its middle, take about six roundings of 6e-8: 6e-5 of a pixel, of
# which neighbours differ by at most 1.
TEXTURE_FLOAT32 = 1e-4

# Half precision rounds values below 1 by 2^-12; a texture unit's weights have 8 bits along each axis, which
# rounds them by 2^-9, of neighbours that differ by less than 1/2.
TEXTURE_FLOAT16 = 2**-12 + 2 * 2**-9 / 2

# Rounded to 1/255 when stored, and once more along each axis where the unit's filter works with 8 bits; the
# weights' share as above.
TEXTURE_RGBA8 = 1.5 / 255 + 2 * 2**-9 / 2

# One rounding in mixing equal numbers.
TEXTURE_CONSTANT = 3e-7

# --- Eyes that have moved ---------------------------------------------------------------------------------

# A cut between slabs at c from a slice moves the look-up of the piece beyond it by up to c: as BORDER_SMOOTH,
# but the test's noise changes by up to 1 · 0.36 of extinction a voxel: 0.36 · 1.7 / 16 = 0.04 at worst, for
# one of some ten slices that make up a pixel, rms over phases (c uniform in 0 … ½) and noise about a quarter.
CUT_SLICES = 0.01

# The same pixels moved along by a fraction of a pixel: a blob 5 pixels wide and more is a sum of bilinear
# look-ups of tents, whose centroid a lattice of pixels finds to 0.01 (as MARKER_PIXELS), twice.
MARKER_MOVES = 0.02

# A plane off the best by a quarter of a step of the look, an eighth of the range: near the best, planes an
# eighth of it apart differ by 2 dB, a quarter of which is 0.5; twice that, as shifts are not very small.
BEST_PLANE_DB = 1.0

# --- Pictures ---------------------------------------------------------------------------------------------

# Quality 1, a pixel a voxel, volumes of 64³ in 96² pixels. Smooth transfer functions: what users are
# promised, 38 dB. Opaque ones: an edge is displaced by a fraction of a pixel, about a fifth, along
# silhouettes and inner edges that fill some 6 % of so small a picture: −10 log10(0.06 · 0.2²) = 26 dB.
PICTURE_SMOOTH_DB = 38
PICTURE_SURFACE_DB = 26

# From inside, quality 1: what the eye stands in is magnified and smooth, what is far is a pixel every other
# voxel. Goal of smooth transfer functions.
INSIDE_SMOOTH_DB = 40

# A step of 1e-6 voxel moves a look-up to the neighbouring table entry: (0.25 opacity / 165 values) / 8
# entries a value = 1.9e-4 of extinction, in few samples of a ray; twice that for two of them at one step.
CONTINUOUS = 4e-4

# What is promised of a homogeneous medium. Elsewhere two faces have the same pixels on a seam, and a picture
# 1e-5 degrees wide differs by 2e-7 rad / pitch, below 1e-5, times the difference of neighbouring pixels.
SEAM = 1e-4

# --- Classification ---------------------------------------------------------------------------------------

# Nearest entry, at most 1/16 of a grey level off; the steepest slope in the test is 0.3 / 70 in opacity,
# which is below 0.0061 in extinction: 0.0061 / 16 = 3.9e-4.
TABLE = 4e-4

# Entries half a level apart, and an eighth: 5/16 of a level off, of opacity 0.5 / 120 a level, 0.0083 of
# extinction at most where it is 0.5: 0.0026 of a sample, of some with either sign, a tenth of a ray each.
BOX_TABLE = 5e-3
# Rms of pictures at eight pixels a voxel, 24 across: gradients bend at every cell's border, where extinctions
# of up to 1.2 begin within a tenth of a voxel, and pixels show what is on one side; 0.1 of a tenth of them.
PICTURE_2D = 0.012

# --- Light of packets -------------------------------------------------------------------------------------

# Distances of hit points in pieces of one interval. The share of extinction is a fraction that errs by 0.011;
# of rows of a piece that holds 16 or more, one step of extinction may take 100 · 0.75 / 0.5 / 1024 = 0.15,
# within which the place is interpolated.
HIT_SHARE = 0.011
HIT_PART = HIT_SHARE + 0.15 / 16
# A place off by HIT_SHARE of a ray's 1.7 voxels turns the normal of a field with a radius of 6 voxels or
# more by 0.003; mirrored light, of some power 8, changes by less than half of that.
LIT_PIECE_TWIN = 1.5e-3

# Relative to the largest value: two samples of PACKET_SAMPLE, and places of up to 64 voxels, rounded by
# 4e-6 where a neighbour's is found, of values that differ by up to twice the largest; per half a voxel or
# more of distance between them.
PACKET_SLOPES = (2 * 1.1e-6 + 2 * 2 * 4e-6) / 0.5
# Cosines of float32 normals, some ten roundings of 6e-8, to the power of 50; of lights of up to 0.3.
PACKET_LIGHT = 3e-5
# Reflectance maps. A place on the octahedron has some five roundings of 6e-8; across it diffuse light changes
# by up to √3 times the lights' colours (2 in sum), and is multiplied by up to √3 again; and as many roundings
# of the sum. Mirrored light of power p changes by √3·0.61·√p of a highlight: of power 100 by ten of 0.6.
MAP_LOOK_UP = 2 * 3 * 10 * 6e-8
# Diffuse maps err most where a light sets, in proportion to a triangle's edge; how they lie there differs.
# Maps of mirrored light: the next term of the error is power / half² of the first, 0.1 at the coarsest.
MAP_ORDER = 0.15

# --- Powers of cosines ------------------------------------------------------------------------------------

# x^power = 2^y. y is rounded to 24 bits, which is |y| · ln 2 · 6e-8 of 2^y; its logarithm is a sum of an
# exponent and a series, each rounded: as much again; and 2^y itself to 1e-7.
PHONG_POWER = 1.2e-7
# Where log2 x is small, its series errs by a few 6e-8 of itself, and (m − 1) is exact; where it is not small,
# by artanh's next term, s⁹/9 ≤ 0.1716⁹/9 = 1.4e-8, times 2.9: of the result times the power.
PHONG_LOG = 1.5e-7

# --- Levels of detail -------------------------------------------------------------------------------------

# A coarse voxel is a float32 sum of up to 45 products (3 · 3 rows, 5 taps) of weights that sum to 1, relative
# to the largest value: 6e-8 each, mostly cancelling.
LEVEL = 1e-6

# Rounding to integers errs by 1/√12 in each voxel, independently: standard deviations of a mean of them
# allowed for; random values, so one in 2 million tests would fail.
LEVEL_ROUNDING_DEVIATIONS = 5

# --- Packets ----------------------------------------------------------------------------------------------

# Three interpolations in float32, each a difference (up to twice the largest value), a product and a sum, of
# 6e-8 each: 9 · 2 · 6e-8, relative to the largest value.
PACKET_SAMPLE = 1.1e-6

# The exponent y of α = 1 − 2^y is a product of four float32 numbers, one of them a sum: 6 roundings of 6e-8,
# and as many in the polynomial and the blending; absolute, and relative to α where nothing lies in front.
PACKET_BLEND = 8e-7

# The same picture by operations that fuse differently: a look-up may fall on the neighbouring table entry. Of
# 8-bit data one entry is (0.69 extinction / 255 values) / 8 entries a value = 3.4e-4 of a sample, in some of
# the samples of a ray, which are a tenth of it each and err with either sign.
PORTABLE_IMAGE = 1e-4

# … and normals and highlights of up to 3 instead of colours below 1.
PORTABLE_LIT = 3 * PORTABLE_IMAGE
# … and entries of half a level, four times as far apart, of 0.51 extinction / 100 values.
PORTABLE_2D = 3 * PORTABLE_IMAGE * 4

# --- Pictures with levels of detail -----------------------------------------------------------------------

# Relative. End voxels of a ramp are too bright at its foot and too dark at its top, as much but at other
# distances: a quarter of a coarse voxel's rise on half a voxel, of 128.
RAMP_BRIGHTNESS = 0.005
# Pixels five voxels apart see some 250 independent columns of 13 coarse planes or more: 0.58 / √(250 · 13).
NOISE_BRIGHTNESS = 0.01
# 81 places of a pixel four voxels wide, against tents that wide; 1.8 % measured.
VOXEL_BRIGHTNESS = 0.03

# A step of ours may be so many times the mean step of exact pictures: pixels four voxels apart add their own
# interpolation's wobble, and smooth; 0.8 measured. A level that takes over at once makes over twice the step.
NO_POP = 1.5
# Part of the flicker's energy that is left: noise loses (3/8)² or more across the rays at pixels four voxels
# apart, 0.05 measured; a checkerboard nearly all, 0.01.
FLICKER = 0.1

# --- Wall files --------------------------------------------------------------------------------------------

# Corners within 10 m: sums and products of a few float64 numbers, 1e-15 of their size each.
RIG_CORNERS = 1e-12

# --- Tracking ---------------------------------------------------------------------------------------------

# Prediction over times of 5 … 80 ms, of a motion with angular frequencies of up to 5 rad/s: the next term of
# the error is 5 rad/s · 80 ms = 0.4 of the first at the coarsest, which bends a slope over four halvings by
# about a tenth.
PREDICTION_ORDER = 0.1
# Corners within 10 m: sums and products of a few float64 numbers, 1e-15 of their size each.
RIG_CORNERS = 1e-12
# --- Stereo and presenting --------------------------------------------------------------------------------

# Dubois' matrices have three decimals; six of them sum to a row: 6 · 0.0005 = 0.003.
NEUTRAL_ANAGLYPH = 3e-3

# A composed pixel is one picture over the background, or six products of them: ten roundings of 6e-8.
COMPOSED = 6e-7
# Half precision rounds by 2⁻¹² of a value below 1, a picture's colour and alpha once each; rows of both of
# Dubois' matrices have absolute sums below 1.5: 1.5 · 2 · 2⁻¹².
COMPOSED_HALF = 7.4e-4
# The screen's bytes: values half way between two of them may be rounded either way.
BYTE = 1
# A picture on its own wall: interpolated positions are off by 2⁻²² of the picture's width, and a rasteriser's
# bilinear weights have 8 bits of a texel, times the difference of neighbours.
ON_ITS_WALL = 1 / 256

# --- The preview -------------------------------------------------------------------------------------------

# Mean of a picture of 192 × 144 pixels, sRGB 0 … 1. OpenGL blends the soft rims of lines and letters in
# linear light, Pillow in sRGB, where half of white is 0.22 darker; rims are some 7 % of so small a picture.
ROOM_LINES = 0.015

# --- Plug-in ----------------------------------------------------------------------------------------------

# Inverses of float64 matrices with condition numbers up to 1e5 (windows far off the axis): 1e-16 · 1e5 of
# places up to 1e3 pixels away.
HOST_PIXELS = 1e-7
# A host's float32 view matrix shifts by some 100 units, rounded to 4e-6, at distances of 20 units and more,
# seen in 200 pixels of 0.6 rad: 4e-6 / 20 / 0.6 · 200 = 7e-5, a few times for three axes and their turns.
HOST_FLOAT32_PIXELS = 1e-3
# A picture of half floats holds the scene and the scene with the volume, each rounded by 2⁻¹² of values below
# 1, a sum of which is compared; the scene itself is one of four samples' mean.
HOST_PICTURE_HALF = 1e-3
# Bilinear weights of 8 bits along each axis, of neighbours that differ by less than 1/4 in a smooth volume:
# 2 · 2⁻⁹ / 4; and corners in float32.
QUADS = 2e-3
# Quads end at a seam, where we mix what two faces show of a zone: half of what they differ by, each off by up
# to 0.008 where a smooth volume of 16 voxels is sampled once a slice.
QUADS_AT_SEAMS = 8e-3
# An sRGB picture of bytes: rounded when the scene is written, half a step, of which (1 − α) is let through
# and made up to twice as many by the curve, where light is low; and rounded again.
CPP_BYTES = 1.5

# --- Traces ------------------------------------------------------------------------------------------------

# Milliseconds made of two times that a trace keeps to 0.5 µs each; those it keeps as such are nearer.
TRACE_DECIMALS = 2 * 0.5e-3

# --- The atlas ---------------------------------------------------------------------------------------------

# The plain ray caster sums up to a hundred float32 numbers below 1: 6e-8 each, mostly cancelling.
FLOAT32_PICTURE = 2e-6
# Midpoints of 4 … 64 pieces of a ray: the next term of the error is 1/16 of the first at the coarsest.
PLAIN_ORDER = 0.1

# --- Properties --------------------------------------------------------------------------------------------

# A ray's light is a sum of at most 4 · 24 samples and their weights, each rounded twice by 6e-8; and the mean
# colour of a pre-integrated piece is a difference of sums over up to 1024 steps, as long as one of them.
POSSIBLE = 1.2e-5 + 1024 * 6e-8
# Below 2^-126 float32 holds ever fewer bits; such a length times 2^30, of an extinction as much smaller.
FEW_BITS = 2.0**-95
# Waves of 2π/0.7 voxels and longer (0.4 a voxel along each axis) in slices met at up to 3 voxels, phases h of
# 2 and less: a trapezoid sum of their varying half errs by h²/12 = 0.33, half of it a mean. Beside it a row
# may gain or lose half a pixel at each end, where the box is seen to begin and to end.
OF_ALPHA = 0.17
# Rms of a picture whose voxels are stored along other axes: of a hundred rays one runs along an edge of the
# box or a seam of two faces, where either side may be taken, which differ by up to 0.01 there; 0.01 · √0.01.
STORED_OTHERWISE = 1e-3

# --- The panel ---------------------------------------------------------------------------------------------

# Of a pixel: positions of widgets and pointers are float32 numbers below 4096, whose steps are 2.5e-4 at
# most, and a few of them make a place.
FLOAT32_PIXELS = 2e-3
# A dot moved along its line is projected again: float64, magnified by lines seen nearly end on.
HANDLE_PIXELS = 1e-6
# --- Flights and films -------------------------------------------------------------------------------------

# Cubics of numbers up to 100 and a dozen products of unit quaternions, float64; a few 1e-15 of each …
FLIGHT_TWIN = 1e-11
# … and a quaternion from a matrix (an eigenvector), degrees from radians, a place from two others.
FLIGHT_FILE = 1e-11

# Steps of a 400th of the way are chords: where the way bends by an angle of up to 1 rad in one, shorter by
# angle² / 24 = 4 %. The table of the way, with 256 lines from key to key, adds less than 1 %.
FLIGHT_SPEED = 0.05

# H.264 at constant rate factor 16 quantises with steps of 4 levels at most (QP 16), in the dead zone by up to
# one step: 4 levels in a frame of nothing else, 20·log10(255 / 4) = 36 dB. Chroma of half the resolution
# changes smooth pictures by less.
FILM_DB = 36
# A flat colour is its own mean: what is left is the rounding of Y, Cb and Cr to 8 bits (of 219 and 224
# levels), 0.5 · (1.16 + 2.11) levels of blue at worst, and that of the step, 1. A matrix or a range mixed up
# errs by over 8.
FILM_FLAT = 3
# --- Probes ------------------------------------------------------------------------------------------------

# Some thousand float64 operations; sums over the table, up to 1e4 times a difference of two of them.
PROBE_TWIN = 1e-11
# The transfer function's table is of float32: 6e-8 of an extinction, of which 0.05 voxels are told.
PROBE_TABLE = 6e-8 * 0.05
# Waves of 2π/¼ voxels: over a step of one voxel the value leaves its chord by (¼)²/8 of its amplitude, which
# is half of all there is, in colour and in extinction.
PROBE_SMOOTH = 2 * 0.25**2 / 8 / 2
# Where a step crosses an edge from nothing to all, its colours are mixed whichever comes first: they differ
# by up to 0.8, and half of the square of its opacity, 0.16 in half a voxel, is mixed wrongly.
PROBE_EDGES = 0.8 * 0.16**2 / 2
# Waves as of PROBE_SMOOTH in steps of half a voxel leave a quarter of that, 0.008; magnitudes are read to
# 1/126 of the function's, a hundredth of its slope, either way from sample to sample.
PROBE_GRADIENTS = 0.01
# A step of half a voxel, in which hits are looked for in pieces of 1/16: where the value is linear an opaque
# surface lies within such a piece.
PROBE_SURFACE = 0.5 / 16
# Pieces of 0.4 / 16 of noise of a few table entries; opacity before them, of pieces of 0.4, adds as much.
PROBE_PIECES = 2 * 0.4 / 16

# --- Marks -------------------------------------------------------------------------------------------------

# A handful of float32 operations on numbers up to 1, and the compositor's own CLOSED_FORM, twice.
MARK_FLOAT32 = 6e-6
# Pieces of 3 pixels of up to 0.6 voxels each, in fog of 0.36 a voxel: what is in front of their ends differs
# by an exponent of 0.65, whose chord leaves the exponential by 0.65²/8 of it, of colours that differ by 0.8.
MARK_INK = 0.65**2 / 8 * 0.8
# OpenGL beside the processor, sRGB 0 … 1: half floats, and lines' places in float32, which move the rim of a
# line by some thousandths of a pixel, in linear light as much, of which the dark makes 12.9 times as much.
MARK_OPENGL = 3 / 255
# Words are half floats, rounded by 2⁻¹²; a few rims of lines, whose places are float32, move as above.
MARK_HALF = 2e-3
