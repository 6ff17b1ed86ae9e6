"""What a run tells its reader: a self-contained HTML report and a table for the terminal."""

from palpate.reporting.data import ExplorationReport as ExplorationReport
from palpate.reporting.data import KeyFigure as KeyFigure
from palpate.reporting.data import TimeSeries as TimeSeries
from palpate.reporting.data import TrueSurface as TrueSurface
from palpate.reporting.growth_data import GrowthCurve as GrowthCurve
from palpate.reporting.growth_data import GrowthReport as GrowthReport
from palpate.reporting.growth_data import GrowthSnapshot as GrowthSnapshot
from palpate.reporting.map_data import MapReport as MapReport
from palpate.reporting.map_data import ShapeReport as ShapeReport
from palpate.reporting.report import report_html as report_html
from palpate.reporting.report import write_report as write_report
from palpate.reporting.terminal import summary_table as summary_table
