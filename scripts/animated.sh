#!/usr/bin/env bash
# Ten seconds of a film as an animated picture: how the README's first one was made.
#   dance-retarget g1moves_tiktok.csv --fps 60 --robot g1 -o tiktok.npz
#   dance-play tiktok.npz --film tiktok.mp4 --width 720 --height 480
#   scripts/animated.sh tiktok.mp4 5 docs/pictures/dance.webp
set -euo pipefail
ffmpeg=$("${PYTHON:-python}" -c "import imageio_ffmpeg; print(imageio_ffmpeg.get_ffmpeg_exe())")
"$ffmpeg" -v error -y -ss "$2" -t 10 -i "$1" -vf "fps=15,crop=480:400:120:50,scale=420:-1:flags=lanczos" \
  -c:v libwebp -loop 0 -q:v 60 "$3"
