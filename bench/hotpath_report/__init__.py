# SPDX-License-Identifier: Apache-2.0
"""Figures and pages about runs of `hotpath`. The C++ program measures and computes; this package reads and draws."""
