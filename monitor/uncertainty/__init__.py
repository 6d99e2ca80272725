"""Uncertainty after JCGM 102:2011: input covariance, GUM framework, adaptive Monte Carlo, coverage, validation."""

from monitor.uncertainty.adaptive import MonteCarloResult, Tolerances, adaptive_monte_carlo, monte_carlo
from monitor.uncertainty.covariance import (
    Inputs,
    covariance_of_day,
    joined,
    overall,
    pooled_by_day,
    uncorrelated,
)
from monitor.uncertainty.coverage import (
    Sampled,
    correlated_rectangle_factor,
    ellipsoid_factor,
    joint_coverage,
    rectangle_factor,
    sample_ellipsoid_factor,
    sample_rectangle_factor,
    single_factor,
)
from monitor.uncertainty.degrees_of_freedom import effective_dof
from monitor.uncertainty.framework import BudgetLine, FrameworkResult, OutputContribution, gum_framework
from monitor.uncertainty.intervals import coverage_interval
from monitor.uncertainty.marginals import (
    Arcsine,
    Empirical,
    Marginal,
    Normal,
    Rectangular,
    StudentT,
    Triangular,
)
from monitor.uncertainty.montecarlo import RunEstimator, run_estimator
from monitor.uncertainty.projection import Projection, nearest_correlation
from monitor.uncertainty.propagation import Model, Summary
from monitor.uncertainty.row_problem import RowProblem, repeated_readings, run_problem
from monitor.uncertainty.run_problem import OneRun, RunProblem
from monitor.uncertainty.sampling import (
    BlockSampler,
    JointDistribution,
    block_generator,
    independent,
    normal_inputs,
    t_inputs,
)
from monitor.uncertainty.sensitivity import Sensitivity, sensitivity_of
from monitor.uncertainty.tolerance import numerical_tolerance
from monitor.uncertainty.validation import Comparison, Validation, validate

__all__ = [
    "Arcsine",
    "BlockSampler",
    "BudgetLine",
    "Comparison",
    "Empirical",
    "FrameworkResult",
    "Inputs",
    "JointDistribution",
    "Marginal",
    "Model",
    "MonteCarloResult",
    "Normal",
    "OneRun",
    "OutputContribution",
    "Projection",
    "Rectangular",
    "RowProblem",
    "RunEstimator",
    "RunProblem",
    "Sampled",
    "Sensitivity",
    "StudentT",
    "Summary",
    "Tolerances",
    "Triangular",
    "Validation",
    "adaptive_monte_carlo",
    "block_generator",
    "correlated_rectangle_factor",
    "covariance_of_day",
    "coverage_interval",
    "effective_dof",
    "ellipsoid_factor",
    "gum_framework",
    "independent",
    "joined",
    "joint_coverage",
    "monte_carlo",
    "nearest_correlation",
    "normal_inputs",
    "numerical_tolerance",
    "overall",
    "pooled_by_day",
    "rectangle_factor",
    "repeated_readings",
    "run_estimator",
    "run_problem",
    "sample_ellipsoid_factor",
    "sample_rectangle_factor",
    "sensitivity_of",
    "single_factor",
    "t_inputs",
    "uncorrelated",
    "validate",
]
