# SPDX-License-Identifier: Apache-2.0
"""The reproduction of the paper's evaluation: what is run, what is claimed, and what came out."""
