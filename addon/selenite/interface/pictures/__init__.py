# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures in the Image Editor and through a camera: of a fit, and of what counts of a photo."""
