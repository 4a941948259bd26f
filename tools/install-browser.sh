#!/usr/bin/env bash
# Chromium of the distribution, for the tests that look at the live page and for screenshots of the site.
exec "$(dirname "$0")/install_apt.sh" "browser tests" chromium fonts-dejavu-core
