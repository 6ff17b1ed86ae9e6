"""Slip detection without known friction: tangential load begins to follow a dither of the grip force.

In full slip f_t = mu f_n and tau = mu e f_n, each shared by direction: the load is proportional to the normal
force, ripple included. While the contact sticks it is what gravity and motion make it, whatever the grip. Both
f_n and the load pass the same filter, a difference over half a ripple's cycle taken three times,

    y(k) = (a(k) - 3 a(k - h) + 3 a(k - 2 h) - a(k - 3 h)) / 8,

which passes the ripple whole and takes parabolas out exactly, and of a shaking at a sixth of the frequency all but
2 % (taken twice, it would leave 7 %, and 40 Hz passed for slip). Per sample and axis two hypotheses then face
each other, r the mean load over the mean normal force:

    slipping:  y = r y_n + noise          sticking:  y = noise

or, under both, now and then anything else (blows, ringing). Friction may follow the normal force late (frictional
memory; Hess & Soom 1990), and a tenth of a ripple's cycle is enough to be taken for neither. So while slipping y_n
is that of this sample or that of `lag` before, as likely the one as the other.

A load that swings by itself, as a shaken one does, is no slip: there it stays the same share of the normal force.
How far the four samples are from that counts against it; without this, shaking at 40 Hz on the simulated hand,
where the ripple cannot be as fast, passes for slip some ten times a minute.

Page's test sums the logarithms of their ratio. A blow that is not r y_n by chance speaks for neither, and one that
is by chance only once.
"""

import math
from collections import deque
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_positive, not_negative, positive
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.kinds import SlipKind, kind_of_slip
from palpate.friction.slip.load_noise import LoadNoise
from palpate.friction.slip.page_test import PageTest

NOISE_GAIN = math.sqrt(20.0) / 8.0
"""Of white noise through the filter: the root of 1 + 9 + 9 + 1, over 8."""

_Row = tuple[float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class ExcitedParameters:
    """Parameters of the detection.

    Attributes:
        threshold: Of Page's test.
        most: What one sample may add to it.
        blow: Probability per sample and axis of something else.
        blow_size: Its standard deviation, as a share of the load on that axis.
        looseness: By which share r y_n may be off while slipping: mu changes with speed, slip with direction.
        gate: Load ratio, on the surface given, below which nothing slips.
        steady: Share by which the load may change over the four samples while slipping, root mean square.
        lag: By which friction may follow the normal force [s], rounded to periods; not at all is allowed for too.
            The friction plant's follows by one time step, 1 ms in the simulated hand; the slip is then detected 4
            ms later if only no lag is allowed for.
    """

    threshold: float = 16.0
    most: float = 4.0
    blow: float = 0.2
    blow_size: float = 0.2
    looseness: float = 0.3
    gate: float = 0.95
    steady: float = 0.1
    lag: float = 1e-3

    def __post_init__(self) -> None:
        check_positive(self, threshold="", most="", blow_size="", looseness="", gate="", steady="")
        not_negative("lag", self.lag, "s")
        if not 0.0 < self.blow < 1.0:
            raise InvalidValueError(f"blow = {self.blow}: must lie between 0 and 1")


class ExcitedSlip:
    """Detects slip of one contact while its grip force is dithered. One call of `step` per period."""

    def __init__(
        self,
        weakest: LimitSurface,
        dither: GripDither,
        period: float,
        noise: LoadNoise | None = None,
        parameters: ExcitedParameters | None = None,
    ) -> None:
        """Take what is known.

        Args:
            weakest: The least that friction can be: within it nothing slips.
            dither: The ripple; only its frequency is used, amplitude and phase are measured.
            period: Between two samples [s].
            noise: Of one sample.
            parameters: Parameters of the detection.

        Raises:
            InvalidValueError: The ripple is too fast for the period.
        """
        self.weakest = weakest
        self._half = dither.half_cycle(positive("period", period, "s"))
        self._noise = noise or LoadNoise()
        self._own = own = parameters or ExcitedParameters()
        self._test = PageTest(own.threshold, own.most)
        self._lag = round(own.lag / period)
        self._needed = 3 * self._half + 1 + self._lag
        self._past: deque[_Row] = deque(maxlen=self._needed)

    weakest: LimitSurface
    """May be replaced at any time."""

    @property
    def evidence(self) -> float:
        """From 0 to 1: how near it is to an alarm."""
        return self._test.sum / self._own.threshold

    def step(self, load: ContactLoad) -> SlipKind | None:
        """Take one sample; return the kind of slip as long as there is one.

        A load that is NaN breaks the row of samples: it begins anew.
        """
        past, own = self._past, self._own
        now = (load.normal_force, *load.tangential_force, load.spin_torque)
        if not math.isfinite(sum(now)):
            past.clear()
            self._test.restart()
            return None
        past.append(now)
        if len(past) < self._needed:
            return None
        ratio = self.weakest.load_ratio(load.normal_force, load.tangential_length, load.spin_torque)
        if ratio < own.gate or load.normal_force <= 0.0:
            self._test.add(-own.most)
            return self._slip_kind(load)
        self._test.add(self._log_ratio())
        return self._slip_kind(load)

    def _slip_kind(self, load: ContactLoad) -> SlipKind | None:
        return kind_of_slip(self.weakest, load) if self._test.alarm else None

    def _log_ratio(self) -> float:
        """Log of the likelihood of slipping over that of sticking, all axes."""
        own, past, half, lag = self._own, self._past, self._half, self._lag
        a, b, c, d = past[lag], past[lag + half], past[lag + 2 * half], past[-1]
        pressed = 0.125 * (d[0] + 3.0 * c[0] + 3.0 * b[0] + a[0])
        ripple = 0.125 * (d[0] - 3.0 * c[0] + 3.0 * b[0] - a[0])
        earlier = 0.125 * (past[3 * half][0] - 3.0 * past[2 * half][0] + 3.0 * past[half][0] - past[0][0])
        force, torque = NOISE_GAIN * self._noise.force, NOISE_GAIN * self._noise.torque
        log_ratio, tiny = -self._unsteady(a, b, c, d), 1e-300  # no logarithm of 0 where all three underflow
        for i in range(1, 5):
            noise = force if i < 4 else torque
            y = 0.125 * (d[i] - 3.0 * c[i] + 3.0 * b[i] - a[i])
            mean = 0.125 * (d[i] + 3.0 * c[i] + 3.0 * b[i] + a[i])
            r = mean / pressed
            follows = 0.5 * (self._density(y, r, ripple, noise) + self._density(y, r, earlier, noise))
            blow = noise + own.blow_size * abs(mean)
            # the same blows under both, so that an axis without load says nothing
            odd = own.blow / blow * math.exp(-0.5 * (y / blow) ** 2)
            slipping = odd + (1.0 - own.blow) * follows
            sticking = odd + (1.0 - own.blow) * math.exp(-0.5 * (y / noise) ** 2) / noise
            log_ratio += math.log((slipping + tiny) / (sticking + tiny))
        return log_ratio

    def _density(self, y: float, r: float, ripple: float, noise: float) -> float:
        """Of y where it follows a ripple of the normal force, but for a factor that all share."""
        pressing, loose = r * NOISE_GAIN * self._noise.force, self._own.looseness * r * ripple
        variance = noise * noise + pressing * pressing + loose * loose
        off = y - r * ripple
        return math.exp(-0.5 * off * off / variance) / math.sqrt(variance)

    def _unsteady(self, *rows: _Row) -> float:
        """How much the load of four samples speaks against being one share of their normal forces."""
        pressed = 0.25 * sum(row[0] for row in rows)
        # torque counts over e, as on the limit surface
        weight = self.weakest.spin_length_at(pressed) ** -2
        size = off = 0.0
        for i in range(1, 5):
            by = 1.0 if i < 4 else weight
            r = 0.25 * sum(row[i] for row in rows) / pressed
            size += by * (r * pressed) ** 2
            off += 0.25 * by * sum((row[i] - r * row[0]) ** 2 for row in rows)
        # of four samples about their mean noise leaves three quarters
        off -= 0.75 * (3.0 * self._noise.force**2 + weight * self._noise.torque**2)
        return 0.5 * max(off, 0.0) / (self._own.steady**2 * size) if size > 0.0 else 0.0
