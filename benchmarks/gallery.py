"""What light does to six volumes: one sheet of pictures, what each costs, and how far it is from the truth.

    python benchmarks/gallery.py -o gallery
    python benchmarks/gallery.py -o gallery --only mni152_nilearn --size 512
    python benchmarks/gallery.py -o gallery --no-truth

Rows are volumes of the folder --data (else PERSP_SW_DATA, else ../shared/data/volumes); columns are looks:
unlit, lit by the headlight, by a key light with shadows, by the headlight with the gradient's magnitude
modulating opacity, and by a two-dimensional function. Times are medians of --repeats frames after a first, of
compositing alone. PSNR is of a picture of --truth-size pixels, against the float64 reference, kept in
the folder; of shadows only with --truth-shadows. The shadows' time is of making them once, less compilation.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
from pathlib import Path
from statistics import median

import numpy as np
from gallery_scenes import LOOKS, SCENES, keys_of
from PIL import Image, ImageDraw, ImageFont
from rich.console import Console
from rich.table import Table

import persp_sw as psw
from persp_sw.measure.metrics import psnr

BACKGROUND = (0.012, 0.014, 0.018)
_DEFAULT = Path(__file__).resolve().parents[2] / "shared" / "data" / "volumes"


def data_folder() -> Path:
    """Where volumes are: PERSP_SW_DATA may name them, or the folder that has them in `volumes`."""
    named = os.environ.get("PERSP_SW_DATA")
    if not named:
        return _DEFAULT
    return Path(named) / "volumes" if (Path(named) / "volumes").is_dir() else Path(named)


def truth(volume: psw.Volume, keys: dict, folder: Path) -> np.ndarray:
    """The reference's picture of a scene; kept under a name that its keys and voxels make."""
    content = json.dumps(keys, sort_keys=True).encode() + volume.data.tobytes()
    path = folder / "truth" / f"{hashlib.sha256(content).hexdigest()[:16]}.npy"
    if not path.is_file():
        scene = psw.Scene(keys, volume=volume)
        image = psw.reference.render(volume, scene.transfer, scene.view(), look=scene.look,
                                     regions=scene.regions, tolerance=1e-3)  # fmt: skip
        path.parent.mkdir(exist_ok=True)
        np.save(path, image)
    return np.load(path)


def shoot(volume: psw.Volume, keys: dict, repeats: int) -> tuple[np.ndarray, dict]:
    """A picture and its figures."""
    scene = psw.Scene(keys, volume=volume)
    renderer = psw.Renderer(volume, scene.transfer, regions=scene.regions, look=scene.look)
    view = scene.view()
    image = renderer.render(view)
    first, times = dict(renderer.last), []
    encoding = 1e3 * renderer.detail.encode_seconds
    for _ in range(repeats):
        renderer.render(view)
        times.append(renderer.last["composite_ms"])
    last = renderer.last
    return image, {
        "composite_ms": median(times), "samples": last["samples"], "runs_bytes": last["runs_bytes"],
        "encode_ms": encoding, "shadows_ms": max(first["encode_ms"] - encoding, 0.0),
        "threads": last["threads"],
    }  # fmt: skip


def sheet_of(rows: list[list[Path]], names: list[str]) -> Image.Image:
    """All pictures, a row a volume, with captions."""
    tiles = [[Image.open(path).convert("RGB") for path in row] for row in rows]
    size, line = tiles[0][0].width, max(18, tiles[0][0].width // 16)
    ground = tiles[0][0].getpixel((0, 0))
    sheet = Image.new("RGB", (size * len(LOOKS), line + (size + line) * len(rows)), ground)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(0.62 * line)
    for column, caption in enumerate(LOOKS.values()):
        draw.text((size * (column + 0.5), line / 2), caption, (225, 228, 232), font, anchor="mm")
    for number, (row, name) in enumerate(zip(tiles, names, strict=True)):
        top = line + (size + line) * number
        for column, tile in enumerate(row):
            sheet.paste(tile, (column * size, top))
        draw.text((line / 2, top + size + line / 2), name, (150, 156, 166), font, anchor="lm")
    return sheet


def main() -> None:
    """Make pictures, the sheet, the figures and the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("-o", "--out", type=Path, default=Path("gallery"))
    options.add_argument("--data", type=Path, default=data_folder())
    options.add_argument("--size", type=int, default=512)
    options.add_argument("--only", choices=list(SCENES), action="append")
    options.add_argument("--repeats", type=int, default=7)
    options.add_argument("--truth-size", type=int, default=128)
    options.add_argument("--no-truth", action="store_true")
    options.add_argument("--truth-shadows", action="store_true")
    given = options.parse_args()
    names = given.only or list(SCENES)
    missing = [name for name in names if not (given.data / f"{name}.nrrd").is_file()]
    if missing:
        listed = ", ".join(f"{name}.nrrd" for name in missing)
        options.error(f"{given.data} has no {listed}; name the folder with --data or PERSP_SW_DATA")
    given.out.mkdir(parents=True, exist_ok=True)
    pictures, results, table = [], [], Table("volume", "look", title=f"{given.size}² pixels")
    for head in ("ms", "× unlit", "samples", "runs MB", "encode ms", "shadows ms", "PSNR dB"):
        table.add_column(head, justify="right")
    for name in names:
        volume = psw.load(given.data / f"{name}.nrrd")
        row, unlit = [], None
        for look in LOOKS:
            keys = keys_of(name, look) | {"volume": name, "size": [given.size] * 2}
            image, figures = shoot(volume, keys, given.repeats)
            row.append(psw.images.write(given.out / f"{name}-{look}.png", image, BACKGROUND))
            unlit = unlit or figures["composite_ms"]
            figures |= {"volume": name, "look": look, "ratio": figures["composite_ms"] / unlit, "psnr": None}
            if not given.no_truth and (look != "shadows" or given.truth_shadows):
                small = keys | {"size": [given.truth_size] * 2}
                figures["psnr"] = psnr(shoot(volume, small, 1)[0], truth(volume, small, given.out))
            results.append(figures)
            table.add_row(
                name, look, f"{figures['composite_ms']:.1f}", f"{figures['ratio']:.2f}",
                f"{figures['samples']:,}", f"{figures['runs_bytes'] / 1e6:.1f}",
                f"{figures['encode_ms']:.0f}", f"{figures['shadows_ms']:.0f}",
                "" if figures["psnr"] is None else f"{figures['psnr']:.1f}",
            )  # fmt: skip
        pictures.append(row)
    sheet_of(pictures, names).save(given.out / "gallery.png")
    values = {"size": given.size, "truth_size": given.truth_size, "rows": results}
    (given.out / "gallery.json").write_text(json.dumps(values, indent=1) + "\n")
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
