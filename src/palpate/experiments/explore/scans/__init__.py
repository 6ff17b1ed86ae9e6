"""Each strategy as a configuration asks for it: where it goes, what it is, and how long it takes."""

from palpate.experiments.explore.scans.active import ActiveScan as ActiveScan
from palpate.experiments.explore.scans.contour import ContourScan as ContourScan
from palpate.experiments.explore.scans.effort import Effort as Effort
from palpate.experiments.explore.scans.on_object import scan_on as scan_on
from palpate.experiments.explore.scans.raster import RasterScan as RasterScan
from palpate.experiments.explore.scans.scan import Scan as Scan
from palpate.experiments.explore.scans.spiral import SpiralScan as SpiralScan
from palpate.experiments.explore.scans.taps import TapScan as TapScan
