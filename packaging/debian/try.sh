#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Tries /tmp/opengpac.deb in a root file system: installs it, starts its daemon as its unit does, moves an arm through it, purges it.
# systemd itself does not run there.
set -e
export DEBIAN_FRONTEND=noninteractive
dpkg -i /tmp/opengpac.deb || { apt-get update -q && apt-get install -y -q --no-install-recommends -f; }
opengpac --help > /dev/null
unit=/usr/lib/systemd/system/opengpac@.service
test -f $unit && test -f /usr/lib/udev/rules.d/70-opengpac.rules && grep -q realtime /etc/security/limits.d/opengpac.conf
getent group realtime
install -d -o opengpac -m 700 /run/opengpac /var/lib/opengpac /var/log/opengpac
line=$(sed -n 's/^ExecStart=//p' $unit | sed 's/%i/cell/g; s/\$OPENGPAC_OPTIONS//')
cat > /tmp/user.py <<'PROGRAM'
import opengpac as gpac
with gpac.connect("unix:///run/opengpac/cell.sock") as cell:
    arm = gpac.robots.load("ur5e").enable()
    goal = gpac.deg([10, -80, 80, -90, -90, 10])
    assert abs(gpac.robots.move(arm, goal=goal, speed=2.0).position - goal).max() < 0.01
    print("the arm of the daemon has moved")
PROGRAM
setpriv --reuid opengpac --regid opengpac --clear-groups env HOME=/var/lib/opengpac XDG_RUNTIME_DIR=/run/opengpac sh -c "cd /var/lib/opengpac && exec $line" > /tmp/said 2>&1 &
daemon=$!
for i in $(seq 300); do grep -q listening /tmp/said && break; sleep 0.1; done
grep listening /tmp/said || { cat /tmp/said; exit 1; }
setpriv --reuid opengpac --regid opengpac --clear-groups env HOME=/var/lib/opengpac /opt/opengpac/bin/python /tmp/user.py
kill $daemon
wait $daemon
test -s /var/lib/opengpac/cell.journal && test -s /var/log/opengpac/cell.audit
dpkg --purge opengpac
! ls -d /opt/opengpac /usr/bin/opengpac /var/lib/opengpac /var/log/opengpac /etc/default/opengpac 2> /dev/null
! getent passwd opengpac
echo "purged without a trace"
