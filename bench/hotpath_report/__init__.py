# SPDX-License-Identifier: Apache-2.0
"""Figures and pages about runs of `hotpath`. C++ measures and computes; this package draws."""
