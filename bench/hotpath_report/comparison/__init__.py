# SPDX-License-Identifier: Apache-2.0
"""Comparison of two results: differences beyond noise, and the gate against regressions."""
