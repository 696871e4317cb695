#!/usr/bin/env bash
# Bundle the parts of three.js that reports use into pop_ros/data/three.min.js.
#
# Needs npm and its registry; run it only to take over a new version of three.js, and name that
# version in NOTICE. The bundle is committed, so that nobody else needs npm.
set -euo pipefail
cd "$(dirname "$0")/.."
three=0.187.0
esbuild=0.28.2

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp scripts/report3d/three_entry.js "$work"
out=$PWD/pop_ros/data/three.min.js
cd "$work"
npm init --yes >/dev/null
npm install --silent "three@$three" "esbuild@$esbuild"
npx esbuild three_entry.js --bundle --minify --format=iife --global-name=THREE \
  --legal-comments=eof --outfile="$out"
