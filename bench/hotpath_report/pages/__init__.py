# SPDX-License-Identifier: Apache-2.0
"""Pages in HTML and Markdown."""
