# SPDX-License-Identifier: Apache-2.0
"""One module per kind of figure, shared by commands and the reproduction of the paper."""
