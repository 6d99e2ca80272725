"""Statistics of repeated runs and of years of campaigns: arrays in, frozen results out.

One method, one file. Units are those of the arrays passed in; nothing here knows a database.
"""

from typing import TYPE_CHECKING

from monitor.on_demand import on_demand

if TYPE_CHECKING:
    from monitor.statistics.changes import (
        Change as Change,
    )
    from monitor.statistics.changes import (
        History as History,
    )
    from monitor.statistics.changes import (
        find_changes as find_changes,
    )
    from monitor.statistics.charts.control import (
        ControlChart as ControlChart,
    )
    from monitor.statistics.charts.control import (
        CusumChart as CusumChart,
    )
    from monitor.statistics.charts.control import (
        Reference as Reference,
    )
    from monitor.statistics.charts.control import (
        correlated_reference as correlated_reference,
    )
    from monitor.statistics.charts.control import (
        cusum_chart as cusum_chart,
    )
    from monitor.statistics.charts.control import (
        ewma_chart as ewma_chart,
    )
    from monitor.statistics.charts.control import (
        individuals_chart as individuals_chart,
    )
    from monitor.statistics.charts.control import (
        known_reference as known_reference,
    )
    from monitor.statistics.charts.control import (
        reference_period as reference_period,
    )
    from monitor.statistics.charts.vector_control import (
        VectorChart as VectorChart,
    )
    from monitor.statistics.charts.vector_control import (
        mewma_chart as mewma_chart,
    )
    from monitor.statistics.charts.vector_control import (
        mewma_limit as mewma_limit,
    )
    from monitor.statistics.charts.vector_control import (
        t_squared_chart as t_squared_chart,
    )
    from monitor.statistics.components import (
        VarianceComponents as VarianceComponents,
    )
    from monitor.statistics.components import (
        variance_components as variance_components,
    )
    from monitor.statistics.conditions import (
        Coefficient as Coefficient,
    )
    from monitor.statistics.conditions import (
        Cycle as Cycle,
    )
    from monitor.statistics.conditions import (
        Dependence as Dependence,
    )
    from monitor.statistics.conditions import (
        DependenceUnits as DependenceUnits,
    )
    from monitor.statistics.conditions import (
        dependence as dependence,
    )
    from monitor.statistics.fdr import (
        FalseDiscoveries as FalseDiscoveries,
    )
    from monitor.statistics.fdr import (
        control_false_discoveries as control_false_discoveries,
    )
    from monitor.statistics.forecasts.backtest import (
        Backtest as Backtest,
    )
    from monitor.statistics.forecasts.backtest import (
        backtest as backtest,
    )
    from monitor.statistics.forecasts.forecast import (
        Crossing as Crossing,
    )
    from monitor.statistics.forecasts.forecast import (
        Forecast as Forecast,
    )
    from monitor.statistics.forecasts.forecast import (
        forecast as forecast,
    )
    from monitor.statistics.forecasts.forecast import (
        predict as predict,
    )
    from monitor.statistics.forecasts.joint_backtest import (
        JointSeries as JointSeries,
    )
    from monitor.statistics.forecasts.joint_backtest import (
        LengthBacktest as LengthBacktest,
    )
    from monitor.statistics.forecasts.joint_backtest import (
        backtest_longest as backtest_longest,
    )
    from monitor.statistics.forecasts.joint_forecast import (
        JointLines as JointLines,
    )
    from monitor.statistics.forecasts.joint_forecast import (
        LengthForecast as LengthForecast,
    )
    from monitor.statistics.forecasts.joint_forecast import (
        LengthQuestion as LengthQuestion,
    )
    from monitor.statistics.forecasts.joint_forecast import (
        forecast_longest as forecast_longest,
    )
    from monitor.statistics.forecasts.joint_forecast import (
        residual_correlation as residual_correlation,
    )
    from monitor.statistics.forecasts.longest_vector import (
        ErrorVectors as ErrorVectors,
    )
    from monitor.statistics.forecasts.longest_vector import (
        longest as longest,
    )
    from monitor.statistics.forecasts.longest_vector import (
        may_be_longest as may_be_longest,
    )
    from monitor.statistics.homogeneity import (
        Histogram as Histogram,
    )
    from monitor.statistics.homogeneity import (
        Homogeneity as Homogeneity,
    )
    from monitor.statistics.homogeneity import (
        p_value_histogram as p_value_histogram,
    )
    from monitor.statistics.means import (
        AnalysisOfVariance as AnalysisOfVariance,
    )
    from monitor.statistics.means import (
        GroupTest as GroupTest,
    )
    from monitor.statistics.means import (
        anova as anova,
    )
    from monitor.statistics.means import (
        brown_forsythe as brown_forsythe,
    )
    from monitor.statistics.means import (
        kruskal_wallis as kruskal_wallis,
    )
    from monitor.statistics.means import (
        robust_p_value as robust_p_value,
    )
    from monitor.statistics.means import (
        welch_anova as welch_anova,
    )
    from monitor.statistics.monotone import (
        MonotoneTrend as MonotoneTrend,
    )
    from monitor.statistics.monotone import (
        mann_kendall as mann_kendall,
    )
    from monitor.statistics.multivariate import (
        VectorTest as VectorTest,
    )
    from monitor.statistics.multivariate import (
        box_m as box_m,
    )
    from monitor.statistics.multivariate import (
        manova as manova,
    )
    from monitor.statistics.normality import Normality as Normality
    from monitor.statistics.pooling import (
        Covariance as Covariance,
    )
    from monitor.statistics.pooling import (
        Pooling as Pooling,
    )
    from monitor.statistics.pooling import (
        pool as pool,
    )
    from monitor.statistics.trend import (
        Resemblance as Resemblance,
    )
    from monitor.statistics.trend import (
        Trend as Trend,
    )
    from monitor.statistics.variances import (
        bartlett as bartlett,
    )
    from monitor.statistics.variances import (
        levene as levene,
    )
    from monitor.statistics.warmup import (
        WarmUp as WarmUp,
    )
    from monitor.statistics.warmup import (
        warm_up as warm_up,
    )
else:
    __getattr__, __dir__ = on_demand(
        __name__,
        {
            "changes": "Change History find_changes",
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
