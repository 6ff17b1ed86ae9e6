"""What can be made to go wrong with an emulated controller."""

from enum import StrEnum


class ControllerFault(StrEnum):
    """Switches of `UrServer.inject`; unless stated otherwise, value 1 switches on and 0 off.

    Attributes:
        DROP_FIN: At once: closes all RTDE connections in good order.
        DROP_RST: At once: breaks them off with a reset.
        STALL_STREAM: Sends no data packages; connections stay.
        LATE_START: An uploaded script starts only after so many seconds of wall time.
        REJECT_START: Rejects requests to start the stream.
        REFUSE_VERSION: Accepts no version of the RTDE protocol.
        WITHHOLD_GREETING: The dashboard says nothing to who connects.
        LOCAL_CONTROL: The dashboard says that the robot is not in remote control.
        STRAY_TEXT: Sends a text message before the next reply of each connection.
        SHORT_DATA: Sends data packages that are one byte too short.
        PROTECTIVE_STOP: At once, 1: the controller stops the arm; 0: unlocked by hand.
        E_STOP: At once, 1: the button is pressed; 0: pulled out again, power still off.
        KILL_PROGRAM: At once: the program ends where it stands.
    """

    DROP_FIN = "drop_fin"
    DROP_RST = "drop_rst"
    STALL_STREAM = "stall_stream"
    LATE_START = "late_start"
    REJECT_START = "reject_start"
    REFUSE_VERSION = "refuse_version"
    WITHHOLD_GREETING = "withhold_greeting"
    LOCAL_CONTROL = "local_control"
    STRAY_TEXT = "stray_text"
    SHORT_DATA = "short_data"
    PROTECTIVE_STOP = "protective_stop"
    E_STOP = "e_stop"
    KILL_PROGRAM = "kill_program"
