# SPDX-License-Identifier: Apache-2.0
"""Programming systems elsewhere: a `System` whose calls go to the control interface of a daemon, `opengpac rts`."""
