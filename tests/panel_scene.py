"""What the panel's programs show: apart from them, for they import OpenGL, which the other tests must not."""

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct

SIZE = (800, 580)  # two of them fit on the virtual screen, one below the other
TRANSFER = psw.TransferFunction(
    [(30.0, (0.2, 0.1, 0.4), 0.0), (80.0, (0.1, 0.6, 0.3), 0.05), (160.0, (0.9, 0.7, 0.2), 0.4)], 1.0
)


def scene(transfer: psw.TransferFunction = TRANSFER) -> psw.Scene:
    """What every program shows, of whatever transfer function."""
    rows = transfer.to_dict()["tf"]
    return psw.Scene.of_volume(synthetic_ct(32), size=SIZE, tf=rows, opacity_unit=transfer.opacity_unit)
