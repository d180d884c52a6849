"""The physical world around the board: one truth that drives all sensors.

Everything is a pure, vectorised function of virtual time in float seconds; nothing here knows of sensors or
firmware.

Frames and signs
    World frame NWU: X north, Y west, Z up. Board axes: X right, Y forward, Z up out of the component side
    (COORDINATE_SYSTEM 3 of ST's firmware). Attitude (roll, pitch, yaw) in degrees is R(board -> world) =
    Rz(yaw) Ry(pitch) Rx(roll). Flat and still, the specific force is (0, 0, +1) g.

North
    Yaw is measured from the frame's north. The default field has no east part, so the frame's north is
    magnetic north and a right compass prints the yaw. A field with an east part turns the compass by
    its declination; ``earth_field(..., north="magnetic")``, the default, therefore turns a place's field so
    that its horizontal part lies on north, and ``north="true"`` keeps the declination. Road not taken: a
    second, geographic north in the frame, which every reader would have to tell from the first.

Units are in the names. What a user gives as a magnetic field is NED microtesla (north, east, down).
"""

from emulator.world.magnetism import earth_field
from emulator.world.recording import Recording, load_recording
from emulator.world.world import World

__all__ = ["Recording", "World", "earth_field", "load_recording"]
