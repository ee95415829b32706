"""Wall files of other systems, read as rigs: ParaView, COVISE/OpenCOVER, CalVR, VR Juggler."""

from .reading import UNITS, Reading, import_rig, read_rig

__all__ = ["UNITS", "Reading", "import_rig", "read_rig"]
