#!/bin/sh
# Are the manual pages of the three programs what groff and mandoc take, and is every flag in them?
#   check_manuals.sh FOLDER_OF_PROGRAMS
# 77 where neither is there.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
bad=0
checked=0
for program in lucerna lucerna-server lucerna-worker; do
  page="$folder/$program.1"
  "$1/$program" help man >"$page"
  grep -q '^\.SH "\?SEE ALSO' "$page" || { echo "$program: the page is cut off"; bad=1; }
  if command -v groff >/dev/null; then
    checked=1
    said=$(groff -man -Tutf8 -Kutf8 -ww -z "$page" 2>&1)
    if [ -n "$said" ]; then echo "$said"; bad=1; fi
    # As it is read: without overstrikes.
    groff -man -Tutf8 -Kutf8 -P-c -P-b -P-u -rLL=400n "$page" >"$folder/shown"
    for flag in $("$1/$program" help | grep -o -- '^ *\(-[a-z],\)\?--[a-z-]*' | grep -o -- '--[a-z-]*'); do
      grep -q -- "$flag\\b" "$folder/shown" || { echo "$program: $flag is not in the page"; bad=1; }
    done
  fi
  if command -v mandoc >/dev/null; then
    checked=1
    # There is no date: a page that changes from day to day would change the package too.
    said=$(mandoc -T lint -W warning "$page" 2>&1 | grep -v 'missing date' || true)
    if [ -n "$said" ]; then echo "$said"; bad=1; fi
  fi
done
if [ $checked = 0 ]; then echo "neither groff nor mandoc is installed: manual pages are not checked"; exit 77; fi
exit $bad
