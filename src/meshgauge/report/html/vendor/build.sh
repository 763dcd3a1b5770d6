#!/bin/sh
# Makes three.min.js anew: one file, minified, in the global THREE. Needs Node.js; run here.
set -eu
version=0.187.0
here=$(pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp entry.js "$work"
cd "$work"
npm install --silent --no-save --ignore-scripts "three@$version" fflate@0.8.3 esbuild@0.28.2
node_modules/.bin/esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2020 \
    --legal-comments=none --charset=utf8 --outfile=bundle.js \
    --banner:js="/*! three.js $version with OrbitControls, (c) 2010-2026 three.js authors; fflate 0.8.3, (c) 2023 Arjun Barrett; MIT licence */"
cp bundle.js "$here/three.min.js"
cp node_modules/three/LICENSE "$here/three.LICENSE.txt"
cp node_modules/fflate/LICENSE "$here/fflate.LICENSE.txt" # three.js holds a copy of fflate
