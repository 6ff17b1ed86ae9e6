"""Options of `palpate view`; imports nothing heavy, so that `palpate --help` is quick."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from palpate.errors import InvalidValueError, positive
from palpate.experiments.kit.options import check_options, option


@dataclass(frozen=True, slots=True)
class ViewConfig:
    """Watch a run in the browser: tip or hand, object, contact forces, the map as it grows, forces as plots.

    With --foxglove or --rerun, wrenches, joints, transforms and contacts go to that program instead.

    The run of a log is played again. An experiment is carried out while it is watched, and recorded.
    Ctrl-C ends the view.

    Example: palpate view explore --set object=ellipsoid force=3

    Example: palpate view runs/explore --time-scale 2

    Example: palpate view runs/grasp --time-scale 0.5

    Example: palpate view runs/explore --video run.gif --time-scale 10

    Example: palpate view explore --foxglove
    """

    what: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="LOG|EXPERIMENT")]
    """Log file (.mcap) of a run, or a folder for its latest.mcap; or an experiment to be carried out: its name, or
    module:Class."""
    time_scale: float = option(1.0, "", infinite=True)
    """Seconds of the run per second of wall time: 2 is twice as fast as in reality; inf: as fast as it can be
    computed. Devices keep real time."""
    set: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=VALUE ...")] = ()
    """Options of an experiment, named as its own command names them, as in object=box force=3; mu stands for
    friction. Several numbers with commas, as in tip=0.008,0.008,0.012."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.YAML")] = None
    """Experiment file; --set overrides it."""
    host: str = "127.0.0.1"
    """Address to listen on: this machine alone; 0.0.0.0 shows the view to everyone in the network. With --rerun,
    the address of the viewer."""
    port: int | None = option(None, within=(0, 65535), remark="; 0 for one that is free")
    """Port to listen on; 0 for one that is free. Left out: 8080, for Foxglove 8765. With --rerun, the port of the
    viewer; left out: 9876."""
    foxglove: bool = False
    """Serve the run's topics to Foxglove (which needs: pip install "palpate[foxglove]")."""
    rerun: bool = False
    """Send the run's topics to a rerun viewer that is open (which needs: pip install "palpate[rerun]")."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.PNG")] = None
    """Instead of opening a view, write an image of a log, drawn by the simulator: of the last contact, or of the
    hardest grip of a grasp."""
    video: Annotated[Path | None, tyro.conf.arg(metavar="FILE.GIF")] = None
    """Instead of opening a view, write a video of a log, drawn by the simulator, at the time scale."""

    def __post_init__(self) -> None:
        check_options(self)
        positive("time_scale", self.time_scale, "", infinite_allowed=True)
        if self.foxglove and self.rerun:
            raise InvalidValueError("--foxglove and --rerun: a run is shown by one of them; leave the other out")
        if (self.foxglove or self.rerun) and (self.picture is not None or self.video is not None):
            raise InvalidValueError(
                "--picture and --video are drawn by the simulator; leave --foxglove and --rerun out"
            )
        if self.log is None and (self.picture is not None or self.video is not None):
            raise InvalidValueError(
                "--picture and --video are made of a log: name one, as in palpate view runs/first --video a.gif"
            )
        if self.log is not None and (self.set or self.config is not None):
            raise InvalidValueError(
                f"--set and --config are for an experiment, and the run of {self.what} is over; leave them out"
            )
        for name, path, suffix in (("picture", self.picture, ".png"), ("video", self.video, ".gif")):
            if path is not None and path.suffix.lower() != suffix:
                raise InvalidValueError(f"{name} = {path}: must end in {suffix}, which is what is written")
        if self.video is not None and math.isinf(self.time_scale):
            raise InvalidValueError("time_scale = inf: a video needs a finite one")

    @property
    def log(self) -> Path | None:
        """Log or folder that is shown; None if `what` names an experiment."""
        place = Path(self.what)
        path = "/" in self.what and ":" not in self.what
        return place if path or place.suffix == ".mcap" or place.is_dir() else None
