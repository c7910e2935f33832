# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit whose photos are rendered by the workers of a dask.distributed cluster."""
