"""Small wall files of other systems, with corners for the head; questions to what was read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from tolerances import RIG_CORNERS

from vr_plugin.formats import Reading, import_rig
from vr_plugin.rig import RigWall

# Two walls 2 × 2 at right angles: the front one at z = −1, the left one at x = −1.
PVX = """<?xml version="1.0" ?>
<pvx>
  <Process Type="client"/>
  <Process Type="server">
    <EyeSeparation Value="0.125"/>
    <Machine Name="front" Environment="DISPLAY=node1:0" Geometry="640x480+10+20" StereoType="Crystal Eyes"
      LowerLeft="-1 -1 -1" LowerRight="1 -1 -1" UpperRight="1 1 -1"/>
    <Machine Name="side" Environment="DISPLAY=node2:0.1" Geometry="500x500-5+0" FullScreen="1"
      LowerLeft="-1 -1 1" LowerRight="-1 -1 -1" UpperRight="-1 1 -1" Sparkle="7"/>
    <Fog/>
  </Process>
</pvx>
"""


def covise(local: str = "", top: str = "", root: str = "") -> str:
    """A host `wall` with one screen 2 m × 1 m, 1 m before the origin, in a window of 800 × 400 at (5, 7)."""
    return f"""<?xml version="1.0"?>
<COCONFIG version="1">
 <GLOBAL><COVER>
  <NumScreens value="0"/>
  <ViewerPosition x="100" y="-2000" z="300"/>
  <Stereo value="on" separation="70"/>
  <ScreenConfig><Screen name="0" comment="GLOBAL" width="1" height="1"/></ScreenConfig>
  {top}
 </COVER></GLOBAL>
 <LOCAL host="wall,wall.site.de"><COVER>
  <NumScreens value="1"/>
  <ScreenConfig>
   <Screen name="0" comment="FRONT" width="2000" height="1000" originX="0" originY="1000" originZ="0"
    h="0.0" p="0.0" r="0.0"/>
   <Screen name="1" comment="FLOOR" width="2000" height="2000" originZ="-500" p="-90"/>
  </ScreenConfig>
  <WindowConfig><Window name="0" left="5" top="7" width="800" height="400"/></WindowConfig>
  <ChannelConfig><Channel name="0" windowIndex="0" stereoMode="LEFT"/></ChannelConfig>
  {local}
 </COVER></LOCAL>
 {root}
</COCONFIG>
"""


INPUT = """<Input>
  <Device>
   <Art driver="dtrack" port="5001"><Offset x="0" y="0" z="-1327"/></Art>
   <Vrpn driver="vrpn" tracker="Head0" host="tracks.site.de"><Orientation h="90"/></Vrpn>
  </Device>
  <Body>
   <ArtHead device="Art" bodyIndex="1"><Offset x="105" y="-50" z="-60"/></ArtHead>
   <ArtHand device="Art" bodyIndex="0"/>
   <VrpnHead device="Vrpn" bodyIndex="3"><Orientation h="0" p="0" r="0"/></VrpnHead>
  </Body>
  <Persons>
   <Person name="other" head="VrpnHead"/>
   <Person name="me" default="true" eyeDistance="61" head="{head}" hand="ArtHand"/>
  </Persons>
 </Input>"""

# Two hosts back to back: `a` is tracked, `b` is drawn for fixed eyes 3 m behind. CalVR's files have several
# roots.
CALVR = """<?xml version="1.0"?>
<PipeConfig><Pipe server="0" screen="0" name="0"/><Pipe server="0" screen="1" name="1"/></PipeConfig>
<Stereo separation="66"/>
<LOCAL host="a">
  <ScreenConfig>
    <Screen originX="0" originY="1000" originZ="0" width="2000" height="1000" h="0" p="0" r="0" name="0"/>
    <Screen originX="-1000" originY="0" originZ="0" width="2000" height="1000" h="90" p="0" r="0" name="1"/>
  </ScreenConfig>
  <ChannelConfig>
    <Channel left="0" bottom="0" width="1000" height="500" stereoMode="QUAD_BUFFER" windowIndex="0" name="0"/>
    <Channel left="0" bottom="0" width="1000" height="500" stereoMode="LEFT" windowIndex="1" name="1"/>
  </ChannelConfig>
  <WindowConfig>
    <Window left="0" bottom="0" width="1000" height="500" pipeIndex="0" name="0"/>
    <Window left="0" bottom="0" width="1000" height="500" pipeIndex="1" name="1"/>
  </WindowConfig>
</LOCAL>
<LOCAL host="b">
  <ScreenConfig>
    <Screen originX="0" originY="0" originZ="0" width="2000" height="1000" h="180" p="0" r="0" name="0"/>
  </ScreenConfig>
  <ChannelConfig>
    <Channel left="0" bottom="0" width="1000" height="500" stereoMode="FIXED_VIEWER" windowIndex="0" name="0">
      <ViewerPosition x="0" y="3000" z="250"/>
    </Channel>
  </ChannelConfig>
  <WindowConfig><Window left="0" bottom="0" width="1000" height="500" pipeIndex="0" name="0"/></WindowConfig>
</LOCAL>
"""

CALVR_INPUT = """<Input>
 <TrackingSystem0 value="VRPN"><VRPN><Server value="Art0@tracks"/></VRPN>
  <Offset x="0" y="0" z="1000"/><Body2><Offset x="10" y="20" z="30"/></Body2></TrackingSystem0>
 <Head0Address system="0" body="2"/>
</Input>
"""

_CORNERS = {
    "lower_left": (-1, 0, -2), "lower_right": (1, 0, -2),
    "upper_right": (1, 1.5, -2), "upper_left": (-1, 1.5, -2),
}  # fmt: skip


def viewport(
    name: str = "v", view: str = "Left Eye", tracked: bool = False, active: bool = True, **moved
) -> str:
    """A surface viewport of VR Juggler, 2 m × 1.5 m, 2 m before the origin."""
    corners = "".join(
        f"<{key}_corner>{value}</{key}_corner>"
        for key, point in {**_CORNERS, **moved}.items()
        for value in point
    )
    return (
        f'<surface_viewport name="{name}"><origin>0.0</origin><origin>0.0</origin>'
        f"<size>1.0</size><size>1.0</size><view>{view}</view>{corners}<active>{str(active).lower()}</active>"
        f"<tracked>{str(tracked).lower()}</tracked></surface_viewport>"
    )


def window(name: str, viewports: str, stereo: bool = False, active: bool = True, y: int = 0) -> str:
    """A display window of 800 × 600, its lower left corner at (100, y) of the screen."""
    return (
        f'<display_window name="{name}"><origin>100</origin><origin>{y}</origin>'
        f"<size>800</size><size>600</size><stereo>{str(stereo).lower()}</stereo><active>{str(active).lower()}</active>"
        f"<surface_viewports>{viewports}</surface_viewports></display_window>"
    )


def jconf(elements: str) -> str:
    """A configuration of VR Juggler."""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<?org-vrjuggler-jccl-settings configuration.version="3.0"?>\n'
        '<configuration xmlns="http://www.vrjuggler.org/jccl/xsd/3.0/configuration">'
        f"<elements>{elements}</elements></configuration>"
    )


def corners(reading: Reading, name: str) -> np.ndarray:
    """Lower left, lower right and upper left of a wall."""
    found = wall(reading, name).wall
    return np.array([found.lower_left, found.lower_right, found.upper_left])


def wall(reading: Reading, name: str) -> RigWall:
    """The wall of a name."""
    return next(wall for wall in reading.rig.walls if wall.name == name)


def near(found: np.ndarray, expected: ArrayLike) -> bool:
    """Whether positions agree as well as sums of a few numbers can."""
    return bool(np.abs(np.asarray(found) - np.asarray(expected, float)).max() <= RIG_CORNERS)


def said(reading: Reading, *words: str) -> bool:
    """Whether a note has all these words."""
    return any(all(word in note for word in words) for note in reading.notes)


def read_in(
    folder: Path, text: str, unit: str | None = None, name: str = "walls.xml", **options: Any
) -> Reading:
    """What a text says as a wall file."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return import_rig(path, unit, **options)
