"""Uncertainty after JCGM 102:2011: input covariance, GUM framework, adaptive Monte Carlo, coverage, validation."""

from monitor.uncertainty.covariance import (
    Inputs,
    joined,
    overall,
    pooled_by_day,
    uncorrelated,
)
from monitor.uncertainty.coverage_regions.coverage import (
    Sampled,
    correlated_rectangle_factor,
    ellipsoid_factor,
    joint_coverage,
    rectangle_factor,
    single_factor,
)
from monitor.uncertainty.coverage_regions.regions import RegionFactors, region_factors
from monitor.uncertainty.degrees_of_freedom import effective_dof
from monitor.uncertainty.framework import FrameworkResult, gum_framework
from monitor.uncertainty.marginals import (
    Arcsine,
    Marginal,
    Normal,
    Rectangular,
    StudentT,
    Triangular,
)
from monitor.uncertainty.monte_carlo.adaptive import (
    MonteCarloOptions,
    MonteCarloResult,
    Tolerances,
    adaptive_monte_carlo,
    monte_carlo,
)
from monitor.uncertainty.monte_carlo.montecarlo import RunEstimator, run_estimator
from monitor.uncertainty.monte_carlo.propagation import Model, Summary
from monitor.uncertainty.monte_carlo.sampling import (
    BlockSampler,
    JointDistribution,
    block_generator,
    independent,
    normal_inputs,
)
from monitor.uncertainty.parts import BudgetLine, Estimated, OutputContribution
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.row_run import RowRun, measured_run, repeated_readings
from monitor.uncertainty.runs.sensitivity import Sensitivity, sensitivity_of
from monitor.uncertainty.runs.touched_run import TouchedRun
from monitor.uncertainty.tolerance import numerical_tolerance
from monitor.uncertainty.validation import Comparison, Validation, validate

__all__ = [
    "Arcsine",
    "BlockSampler",
    "BudgetLine",
    "Comparison",
    "Estimated",
    "FrameworkResult",
    "Inputs",
    "JointDistribution",
    "Marginal",
    "MeasuredRun",
    "Model",
    "MonteCarloOptions",
    "MonteCarloResult",
    "Normal",
    "OutputContribution",
    "Rectangular",
    "RegionFactors",
    "RowRun",
    "RunEstimator",
    "Sampled",
    "Sensitivity",
    "StudentT",
    "Summary",
    "Tolerances",
    "TouchedRun",
    "Triangular",
    "Validation",
    "adaptive_monte_carlo",
    "block_generator",
    "correlated_rectangle_factor",
    "effective_dof",
    "ellipsoid_factor",
    "gum_framework",
    "independent",
    "joined",
    "joint_coverage",
    "measured_run",
    "monte_carlo",
    "normal_inputs",
    "numerical_tolerance",
    "overall",
    "pooled_by_day",
    "rectangle_factor",
    "region_factors",
    "repeated_readings",
    "run_estimator",
    "sensitivity_of",
    "single_factor",
    "uncorrelated",
    "validate",
]
