"""Statistics of repeated runs and of years of campaigns: arrays in, frozen results out.

One method, one file. Units are those of the arrays passed in; nothing here knows a database.
"""

from monitor.statistics.changes import Change, History, find_changes
from monitor.statistics.charts.control import (
    ControlChart,
    CusumChart,
    Reference,
    correlated_reference,
    cusum_chart,
    ewma_chart,
    individuals_chart,
    known_reference,
    reference_period,
)
from monitor.statistics.charts.vector_control import VectorChart, mewma_chart, mewma_limit, t_squared_chart
from monitor.statistics.components import VarianceComponents, variance_components
from monitor.statistics.conditions import Coefficient, Cycle, Dependence, DependenceUnits, dependence
from monitor.statistics.fdr import FalseDiscoveries, control_false_discoveries
from monitor.statistics.forecasts.backtest import Backtest, backtest
from monitor.statistics.forecasts.forecast import Crossing, Forecast, forecast, predict
from monitor.statistics.forecasts.joint_backtest import JointSeries, LengthBacktest, backtest_longest
from monitor.statistics.forecasts.joint_forecast import (
    JointLines,
    LengthForecast,
    LengthQuestion,
    forecast_longest,
    residual_correlation,
)
from monitor.statistics.forecasts.longest_vector import ErrorVectors, longest, may_be_longest
from monitor.statistics.homogeneity import Histogram, Homogeneity, homogeneity, p_value_histogram
from monitor.statistics.means import (
    AnalysisOfVariance,
    GroupTest,
    anova,
    brown_forsythe,
    kruskal_wallis,
    robust_p_value,
    welch_anova,
)
from monitor.statistics.monotone import MonotoneTrend, mann_kendall
from monitor.statistics.multivariate import VectorTest, box_m, manova
from monitor.statistics.normality import Normality, normality
from monitor.statistics.pooling import Covariance, Pooling, pool
from monitor.statistics.trend import Resemblance, Trend, trend
from monitor.statistics.variances import bartlett, levene
from monitor.statistics.warmup import WarmUp, warm_up

__all__ = [
    "AnalysisOfVariance",
    "Backtest",
    "Change",
    "Coefficient",
    "ControlChart",
    "Covariance",
    "Crossing",
    "CusumChart",
    "Cycle",
    "Dependence",
    "DependenceUnits",
    "ErrorVectors",
    "FalseDiscoveries",
    "Forecast",
    "GroupTest",
    "Histogram",
    "History",
    "Homogeneity",
    "JointLines",
    "JointSeries",
    "LengthBacktest",
    "LengthForecast",
    "LengthQuestion",
    "MonotoneTrend",
    "Normality",
    "Pooling",
    "Reference",
    "Resemblance",
    "Trend",
    "VarianceComponents",
    "VectorChart",
    "VectorTest",
    "WarmUp",
    "anova",
    "backtest",
    "backtest_longest",
    "bartlett",
    "box_m",
    "brown_forsythe",
    "control_false_discoveries",
    "correlated_reference",
    "cusum_chart",
    "dependence",
    "ewma_chart",
    "find_changes",
    "forecast",
    "forecast_longest",
    "homogeneity",
    "individuals_chart",
    "known_reference",
    "kruskal_wallis",
    "levene",
    "longest",
    "mann_kendall",
    "manova",
    "may_be_longest",
    "mewma_chart",
    "mewma_limit",
    "normality",
    "p_value_histogram",
    "pool",
    "predict",
    "reference_period",
    "residual_correlation",
    "robust_p_value",
    "t_squared_chart",
    "trend",
    "variance_components",
    "warm_up",
    "welch_anova",
]
