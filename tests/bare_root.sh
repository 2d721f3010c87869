# shellcheck shell=bash
# SPDX-License-Identifier: GPL-3.0-or-later
#
# What the scripts have in common that prove things in a root of their own. To be sourced by bash, in the top folder.

fail() {
  echo "ERROR: $*" >&2
  exit 1
}

# require_root PROGRAM: ends the script, with the exit code by which ctest knows a test that cannot be run here, unless it may
# make a root with PROGRAM.
require_root() {
  ((EUID == 0)) || { echo "Skipped: making a root needs root."; exit 77; }
  command -v "$1" >/dev/null || { echo "Skipped: $1 is missing."; exit 77; }
}

# make_root FOLDER COMMAND...: sets `root` to FOLDER, which COMMAND fills unless it is there. It must then be one that the same
# script has made.
make_root() {
  root=$1
  local mark
  mark=$root/made_by_$(basename "$0")
  if [[ ! -e $root ]]; then
    "${@:2}"
    touch "$mark"
  fi
  [[ -e $mark ]] || fail "$root is there and not a root that this script made; another folder would be right."
}

# debian SUITE FOLDER [OPTION...]: fills FOLDER with a bare Debian.
debian() {
  debootstrap --variant=minbase "${@:3}" "$1" "$2"
  cp /etc/resolv.conf "$2/etc/"
}

# mount_at TARGET OPTIONS...: mounts at a folder of `root`, until the script ends.
mounted=()
mount_at() {
  mkdir -p "$root$1"
  mount "${@:2}" "$root$1"
  mounted+=("$root$1")
}

# Mounts what programs expect of a running system, and an empty /tmp.
mount_system() {
  mount_at /proc -t proc proc
  mount_at /dev --rbind /dev
  mount --make-rslave "$root/dev"
  mount_at /tmp -t tmpfs tmpfs
}

# Lazily: what an interrupted command left running may hold them still.
unmount_all() {
  local i
  for ((i = ${#mounted[@]} - 1; i >= 0; --i)); do umount --recursive --lazy "${mounted[i]}"; done
}
trap unmount_all EXIT

# enter [NAME=VALUE...] PROGRAM ARGUMENTS...: runs a program in `root`, with nothing of this environment.
enter() {
  chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"
}

# inside COMMANDS: runs them by bash in `root`.
inside() {
  echo "== $*"
  enter bash -euc "$*"
}
