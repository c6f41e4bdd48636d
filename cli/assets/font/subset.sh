#!/bin/sh
# Makes DejaVuSans-subset.ttf from the DejaVu Sans of Debian's fonts-dejavu-core; needs fonttools.
set -eu
cd "$(dirname "$0")"
pyftsubset "${1:-/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf}" \
    --unicodes="U+0020-007E,U+00A0-00FF,U+0131,U+0370-03FF,U+2009-2015,U+2018-201D,U+2022,U+2026,U+2032,U+2033,U+2070-209C,U+20D7,U+210F,U+2113,U+2190-2193,U+2202,U+2206,U+2207,U+2211,U+2212,U+2213,U+221A,U+221D,U+221E,U+222B,U+2248,U+2260,U+2261,U+2264,U+2265,U+2297,U+2299,U+22C5,U+25A0,U+25CF" \
    --layout-features='kern' --no-hinting --desubroutinize --drop-tables+=FFTM \
    --output-file=DejaVuSans-subset.ttf
