"""What somebody at the teach pendant would do, by the controller's dashboard server."""

from time import monotonic, sleep

from palpate.hw.ur.latest import Latest
from palpate.hw.ur.library import Library, PendantClient
from palpate.hw.ur.problems import IDLE, RUNNING, Problem, UrRefusal, safety_problem
from palpate.hw.ur.requests import Opening
from palpate.hw.ur.version import DASHBOARD_BELOW

_UNLOCK_WITHIN = 8.0
"""[s] in which a protective stop must let itself be unlocked: a controller refuses during the first 5 s."""

_UNLOCK_EVERY = 0.5
"""[s] between tries."""

_POWER_WITHIN = 30.0
"""[s] for powering and releasing brakes, joint after joint."""


class Pendant:
    """Connects when it is needed: the server ends connections that are left alone."""

    def __init__(self, opening: Opening, library: Library, latest: Latest) -> None:
        """Begin, without a connection.

        Args:
            opening: The process's settings.
            library: Makes the connection.
            latest: State, which tells whether something has worked.
        """
        self._opening, self._library, self._latest = opening, library, latest

    def require_remote_control(self) -> None:
        """See that programs may command the arm.

        Raises:
            Refusal: They may not.
        """
        if self._opening.version[0] != 5:  # CB3 has no such mode, later ones no dashboard: the library knows
            return
        client = self._connected()
        remote = client.isInRemoteControl()
        client.disconnect()
        if not remote:
            raise UrRefusal(
                "it is in local control",
                "choose Remote Control at the top right of the pendant (enable it in Settings, System)",
            )

    def unlock(self) -> None:
        """Unlock a protective stop, as soon as that is allowed.

        Raises:
            Refusal: It is not.
        """
        client = self._connected()
        deadline = monotonic() + _UNLOCK_WITHIN
        while True:
            try:
                client.closeSafetyPopup()
                client.unlockProtectiveStop()
                break
            except (RuntimeError, OSError) as error:
                if monotonic() > deadline:
                    raise UrRefusal(
                        f"the protective stop cannot be unlocked ({error})",
                        "unlock it at the pendant, then `palpate recover`",
                    ) from error
                sleep(_UNLOCK_EVERY)
        client.disconnect()
        self._latest.wait_for(
            lambda s: safety_problem(s.robot_mode, s.safety_bits) is not Problem.PROTECTIVE_STOP,
            _UNLOCK_WITHIN,
            Problem.PROTECTIVE_STOP,
        )

    def power_on(self) -> None:
        """Power the arm, and release its brakes.

        Raises:
            Refusal: It is not powered in time.
        """
        client = self._connected()
        client.powerOn()
        self._latest.wait_for(lambda s: s.robot_mode in (IDLE, RUNNING), _POWER_WITHIN, Problem.NOT_POWERED)
        client.brakeRelease()
        client.disconnect()
        self._latest.wait_for(lambda s: s.robot_mode == RUNNING, _POWER_WITHIN, Problem.NOT_POWERED)

    def _connected(self) -> PendantClient:
        if self._opening.version[0] >= DASHBOARD_BELOW:
            raise UrRefusal("this version has no dashboard server", "do it at the pendant, then `palpate recover`")
        client = self._library.dashboard(self._opening.address)
        client.connect()
        return client
