"""Each strategy as a configuration asks for it: where it goes, what it is, and how long it takes."""

from palpate.experiments.scans.active import ActiveScan as ActiveScan
from palpate.experiments.scans.contour import ContourScan as ContourScan
from palpate.experiments.scans.effort import Effort as Effort
from palpate.experiments.scans.on_object import scan_on as scan_on
from palpate.experiments.scans.raster import RasterScan as RasterScan
from palpate.experiments.scans.scan import Scan as Scan
from palpate.experiments.scans.spiral import SpiralScan as SpiralScan
from palpate.experiments.scans.taps import TapScan as TapScan
