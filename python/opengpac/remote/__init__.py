# SPDX-License-Identifier: Apache-2.0
"""Remote programming systems: a `System` whose calls are sent to the control interface of a daemon, `opengpac rts`."""
