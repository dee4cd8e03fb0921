# SPDX-License-Identifier: Apache-2.0
"""One module for each kind of figure, used by the commands for single runs and by the reproduction of the paper."""
