"""Steps in the magnitude of the acceleration (AN5040 6.1; bank A registers, datasheet 11.16 to 11.19).

Decision: ST does not publish the algorithm. Ours is the plainest that meets what is published: a step is a
peak of the acceleration's magnitude, found when the magnitude has fallen from it by the threshold; the next
peak is looked for once it has risen by the threshold again. So the threshold is a swing from peak to valley
and works against small ripples without a filter. The road not taken, a threshold above the mean, needs a
high-pass filter whose corner would be one more thing nobody knows.
"""

from __future__ import annotations

from dataclasses import dataclass

from sensors.lsm6dsl.bank_a import CONFIG_PEDO_THS_MIN, PEDO_DEB_REG, STEP_COUNT_DELTA
from sensors.sampling import NEVER_PS, PS_PER_S

_LSB_MG = (32.0, 62.5)  # CONFIG_PEDO_THS_MIN.PEDO_FS (datasheet 11.16)
_FULL_SCALE_MG = (2000.0, 4000.0)
_DEBOUNCE_LSB_PS = 80 * PS_PER_S // 1000  # datasheet 11.18
_DELTA_LSB_PS = 16384 * PS_PER_S // 10000  # datasheet 11.19: 1.6384 s


@dataclass(frozen=True)
class PedometerSettings:
    """What bank A says about the pedometer."""

    full_scale_mg: float  # each axis is cut off here, whatever FS_XL allows
    threshold_mg: float
    debounce_steps: int
    debounce_ps: int  # a longer pause and the debounce begins anew
    delta_ps: int  # 0: off

    @classmethod
    def decode(cls, mem: bytearray) -> PedometerSettings:
        """Read the settings out of bank A; a threshold of 0 acts as 1 LSB, where noise would walk."""
        scale = CONFIG_PEDO_THS_MIN.PEDO_FS.get(mem[CONFIG_PEDO_THS_MIN.addr])
        threshold = CONFIG_PEDO_THS_MIN.ths_min.get(mem[CONFIG_PEDO_THS_MIN.addr])
        debounce = mem[PEDO_DEB_REG.addr]
        return cls(
            full_scale_mg=_FULL_SCALE_MG[scale],
            threshold_mg=max(threshold, 1) * _LSB_MG[scale],
            debounce_steps=PEDO_DEB_REG.DEB_STEP.get(debounce),
            debounce_ps=PEDO_DEB_REG.DEB_TIME.get(debounce) * _DEBOUNCE_LSB_PS,
            delta_ps=mem[STEP_COUNT_DELTA.addr] * _DELTA_LSB_PS,
        )


class StepDetector:
    """Finds steps and debounces them."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget the movement so far."""
        self._seeking_peak = True
        self._extreme_mg = 0.0
        self._run = 0  # steps in a row
        self._last_ps = 0

    def feed(self, magnitude_mg: float, at_ps: int, settings: PedometerSettings) -> int:
        """Steps to add to the counter at this sample: none, one, or those of the debounce with the next."""
        if self._seeking_peak:
            self._extreme_mg = max(self._extreme_mg, magnitude_mg)
            if self._extreme_mg - magnitude_mg < settings.threshold_mg:
                return 0
            self._seeking_peak, self._extreme_mg = False, magnitude_mg
            return self._debounced(at_ps, settings)
        self._extreme_mg = min(self._extreme_mg, magnitude_mg)
        if magnitude_mg - self._extreme_mg >= settings.threshold_mg:
            self._seeking_peak, self._extreme_mg = True, magnitude_mg
        return 0

    def _debounced(self, at_ps: int, settings: PedometerSettings) -> int:
        if at_ps - self._last_ps > settings.debounce_ps:
            self._run = 0
        self._last_ps = at_ps
        self._run += 1
        first_counted = settings.debounce_steps + 1
        if self._run < first_counted:
            return 0
        return first_counted if self._run == first_counted else 1


class DeltaTime:
    """Windows of STEP_COUNT_DELTA, one after another: was there a step in it?"""

    def __init__(self) -> None:
        self.end_ps = NEVER_PS
        self._period_ps = 0
        self._stepped = False

    def configure(self, period_ps: int, now_ps: int) -> None:
        """Windows of this length from now on; 0: none. The same length again changes nothing."""
        if period_ps != self._period_ps:
            self._period_ps, self._stepped = period_ps, False
            self.end_ps = now_ps + period_ps if period_ps else NEVER_PS

    def stepped(self) -> None:
        """A step was counted in the present window."""
        self._stepped = True

    def close(self) -> bool:
        """The present window ends and the next begins; whether there was a step."""
        self.end_ps += self._period_ps
        stepped, self._stepped = self._stepped, False
        return stepped
