"""What Schulze, Niemeier and Lang (2001) print, as printed, and what they leave open.

Source: *The perspective shear-warp algorithm in a virtual environment*, IEEE Visualization 2001, section 4.
"""

from __future__ import annotations

TITLE = "Schulze, Niemeier, Lang: The Perspective Shear-Warp Algorithm In A Virtual Environment (2001)"

SYSTEMS = {  # section 4
    "PC": "Pentium 4, 1.4 GHz, 3Dlabs Wildcat II 5110",
    "Onyx2": "SGI Onyx2, one R10000 of 195 MHz (section 4.5: 14 of them), InfiniteReality2",
}

# Section 4.1. The curve's values stand in the picture alone, so that there is none to quote.
FIGURE5 = {
    "caption": "Figure 5: Rendering speed relative to intermediate image size.",
    "section": "4.1",
    "size": (64, 64, 27),
    "output": 300,
    "jumps": (512, 1024),
    "words": "Jumps occur at intermediate image edge lengths of 512 and 1024 pixels because the texturing "
    "hardware, which is used for the warp, requires image sizes which are powers of two.",
}

TABLE2 = {
    "caption": "Table 2: Perspective vs. parallel projection.",
    "section": "4.2",
    "output": 300,
    "ratio": {"PC": 1.43, "Onyx2": 1.46},
}

TABLE3 = {
    "caption": "Table 3: Software vs. texture based warp.",
    "section": "4.3",
    "intermediate": 1024,
    "ms": {
        ("software", 256): {"PC": 20.0, "Onyx2": 32.0},
        ("texture", 256): {"PC": 30.0, "Onyx2": 68.0},
        ("software", 512): {"PC": 60.0, "Onyx2": 108.0},
        ("texture", 512): {"PC": 30.0, "Onyx2": 68.0},
    },
}

TABLE4 = {
    "caption": "Table 4: Compositing vs. warp.",
    "section": "4.4",
    "intermediate": 1024,
    "ratio": {
        ("software", 256): {"PC": 92.1, "Onyx2": 9.71},
        ("texture", 256): {"PC": 17.5, "Onyx2": 50.1},
        ("software", 512): {"PC": 36.8, "Onyx2": 2.40},
        ("texture", 512): {"PC": 17.5, "Onyx2": 50.1},
    },
}

CUBE = {
    "caption": "Application To An Immersive VE.",
    "section": "4.5",
    "size": (64, 64, 27),
    "rate_hz": {"Onyx2": 10.0},
    "words": "Our parallelized implementation of the algorithm renders the 64x64x27 voxels engine data set "
    "at about 10 frames per second.",
}

BRAINSMALL_SIZE = (128, 128, 84)  # the data set named in section 4.4, as VolPack ships it

# What we took where the paper does not say.
ASSUMED = {
    "all": [
        "opacity: the ramp runs from 0 at the least value to 1 at the largest, per voxel; colours are ours",
        "one bilinear sample a slice, as the paper's, without pre-integration; that alone limits the PSNR, "
        "so figure 5 and section 4.5 have the renderer's own choice beside it",
        "view: 45° high, 1.7 longest edges from the volume's centre, a little from the right and above",
        "an eye's short path: every frame is composited and warped afresh",
        "the intermediate image's edge is the longer side of ours, which has no margin around the volume; "
        "the other side follows the volume",
        "tables 2 to 4 and figure 5 on one thread, for the paper used one processor; what OpenGL does on the "
        "processor itself takes as many as it likes",
        "times are medians, here and there the least beside, for other work may share the machine; the error "
        "is that of the path's last picture to a float64 reference of the same voxels, peak 1",
    ],
    "engine": [
        "the engine file's last 18 of 128 slices hold nothing of it: its first 110 give the paper's 55 and "
        "27 slices at half and a quarter of the resolution; trilinear, no filter",
    ],
    "figure5": ["time is compositing and warp, as section 4.1 says"],
    "table2": [
        "the intermediate image's size is not told: at a pixel a voxel (quality 1), and at that of tables 3 "
        "and 4; the parallel view looks along the same line and shows as much of the volume's centre"
    ],
    "table3": [
        "the data set is not told: the engine; the texture warp's time is upload and drawing, until OpenGL "
        "has finished, without reading back"
    ],
    "table4": ["of the same frames: median of compositing over median of warp"],
    "cube": [
        "walls, stereo and sizes are not told: a 3 m room, front, left, right and floor, 1024² pixels each "
        "(section 1: about 1000² a screen), an eye pair that moves in every frame; the volume 2 m long, so "
        "that all four show it",
        "a frame is two compositings, one for each eye, and eight warps; the error is that of the eight "
        "pictures together",
    ],
}
