"""The polar image of a transducer in an acoustic volume: the reference that the browser's shader is tested against."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.ultrasound.echo import complex_echo
from cathxr.ultrasound.field import AcousticField
from cathxr.ultrasound.march import two_way_loss_db
from cathxr.ultrasound.plane import Beams
from cathxr.ultrasound.receive import compressed, envelope
from cathxr.ultrasound.settings import IceSettings, Resolved


@dataclass(frozen=True, eq=False)
class PolarImage:
    """One picture, line by line. Line 0 is the most proximal one, sample 0 is at the transducer's face.

    grey: uint8 (lines, samples). envelope: (lines, samples), as a share of a perfect plane reflector's echo, before
    amplification. loss_db: (loss_lines, loss_samples), there and back, in dB.
    """

    grey: npt.NDArray[np.uint8]
    envelope: FloatArray
    loss_db: FloatArray
    settings: IceSettings

    @property
    def angles_rad(self) -> FloatArray:
        """Each line's angle (lines,) from the sector's centre line; distal is positive."""
        lines = self.settings.lines
        return np.asarray(((np.arange(lines) + 0.5) / lines - 0.5) * self.settings.sector_rad)

    @property
    def ranges_mm(self) -> FloatArray:
        """Each sample's distance (samples,) from the transducer's face, along its line."""
        return np.asarray((np.arange(self.settings.samples) + 0.5) * self.settings.depth_mm / self.settings.samples)


def simulate(
    field: AcousticField, ct_from_transducer: FloatArray, settings: IceSettings | None = None, *, seq: int = 0
) -> PolarImage:
    """Return what a transducer at a pose (4, 4) in `ct`, mm, shows; see `probe` for the frame.

    seq: the picture's number; only the receiver's noise depends on it.

    Raises:
        ValueError: the pose is not a rotation with a translation and a common scale.
    """
    chosen = settings or IceSettings()
    resolved = Resolved.of(chosen)
    beams = Beams.of(field, ct_from_transducer)
    loss_db = two_way_loss_db(field, beams, chosen)
    echo = complex_echo(field, beams, chosen, resolved=resolved, loss_db=loss_db)
    received = envelope(echo, chosen, resolved=resolved, seq=seq)
    return PolarImage(compressed(received, chosen), received, loss_db, chosen)
