"""Statistics of repeated runs and of years of campaigns: arrays in, frozen results out.

One method, one file. Units are those of the arrays passed in; nothing here knows a database.
"""

from typing import TYPE_CHECKING

from monitor.on_demand import on_demand

if TYPE_CHECKING:
    from monitor.statistics.changes import (
        FEWEST_RUNS as FEWEST_RUNS,
        Change as Change,
        History as History,
        find_changes as find_changes,
    )
    from monitor.statistics.charts.control import (
        ControlChart as ControlChart,
        CusumChart as CusumChart,
        Reference as Reference,
        correlated_reference as correlated_reference,
        cusum_chart as cusum_chart,
        ewma_chart as ewma_chart,
        individuals_chart as individuals_chart,
        known_reference as known_reference,
        reference_period as reference_period,
    )
    from monitor.statistics.charts.vector_control import (
        VectorChart as VectorChart,
        mewma_chart as mewma_chart,
        mewma_limit as mewma_limit,
        t_squared_chart as t_squared_chart,
    )
    from monitor.statistics.components import (
        VarianceComponents as VarianceComponents,
        variance_components as variance_components,
    )
    from monitor.statistics.conditions import (
        Coefficient as Coefficient,
        Cycle as Cycle,
        Dependence as Dependence,
        DependenceUnits as DependenceUnits,
        dependence as dependence,
    )
    from monitor.statistics.fdr import (
        FalseDiscoveries as FalseDiscoveries,
        control_false_discoveries as control_false_discoveries,
    )
    from monitor.statistics.forecasts.backtest import (
        Backtest as Backtest,
        backtest as backtest,
    )
    from monitor.statistics.forecasts.forecast import (
        Crossing as Crossing,
        Forecast as Forecast,
        forecast as forecast,
        predict as predict,
    )
    from monitor.statistics.forecasts.joint_backtest import (
        JointSeries as JointSeries,
        LengthBacktest as LengthBacktest,
        backtest_longest as backtest_longest,
    )
    from monitor.statistics.forecasts.joint_forecast import (
        JointLines as JointLines,
        LengthForecast as LengthForecast,
        LengthQuestion as LengthQuestion,
        forecast_longest as forecast_longest,
        residual_correlation as residual_correlation,
    )
    from monitor.statistics.forecasts.longest_vector import (
        ErrorVectors as ErrorVectors,
        longest as longest,
        may_be_longest as may_be_longest,
    )
    from monitor.statistics.homogeneity import (
        Histogram as Histogram,
        Homogeneity as Homogeneity,
        p_value_histogram as p_value_histogram,
    )
    from monitor.statistics.means import (
        AnalysisOfVariance as AnalysisOfVariance,
        GroupTest as GroupTest,
        anova as anova,
        brown_forsythe as brown_forsythe,
        kruskal_wallis as kruskal_wallis,
        robust_p_value as robust_p_value,
        welch_anova as welch_anova,
    )
    from monitor.statistics.monotone import (
        MonotoneTrend as MonotoneTrend,
        mann_kendall as mann_kendall,
    )
    from monitor.statistics.multivariate import (
        VectorTest as VectorTest,
        box_m as box_m,
        manova as manova,
    )
    from monitor.statistics.normality import Normality as Normality
    from monitor.statistics.pooling import (
        Covariance as Covariance,
        Pooling as Pooling,
        pool as pool,
    )
    from monitor.statistics.trend import (
        Resemblance as Resemblance,
        Trend as Trend,
    )
    from monitor.statistics.variances import (
        bartlett as bartlett,
        levene as levene,
    )
    from monitor.statistics.warmup import (
        WarmUp as WarmUp,
        warm_up as warm_up,
    )
else:
    __getattr__, __dir__ = on_demand(
        __name__,
        {
            "changes": "FEWEST_RUNS Change History find_changes",
            "charts.control": "ControlChart CusumChart Reference correlated_reference cusum_chart ewma_chart "
            "individuals_chart known_reference reference_period",
            "charts.vector_control": "VectorChart mewma_chart mewma_limit t_squared_chart",
            "components": "VarianceComponents variance_components",
            "conditions": "Coefficient Cycle Dependence DependenceUnits dependence",
            "fdr": "FalseDiscoveries control_false_discoveries",
            "forecasts.backtest": "Backtest backtest",
            "forecasts.forecast": "Crossing Forecast forecast predict",
            "forecasts.joint_backtest": "JointSeries LengthBacktest backtest_longest",
            "forecasts.joint_forecast": "JointLines LengthForecast LengthQuestion forecast_longest "
            "residual_correlation",
            "forecasts.longest_vector": "ErrorVectors longest may_be_longest",
            "homogeneity": "Histogram Homogeneity p_value_histogram",
            "means": "AnalysisOfVariance GroupTest anova brown_forsythe kruskal_wallis robust_p_value "
            "welch_anova",
            "monotone": "MonotoneTrend mann_kendall",
            "multivariate": "VectorTest box_m manova",
            "normality": "Normality",
            "pooling": "Covariance Pooling pool",
            "trend": "Resemblance Trend",
            "variances": "bartlett levene",
            "warmup": "WarmUp warm_up",
        },
    )
