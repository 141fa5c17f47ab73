#!/usr/bin/env bash
# Brings a Debian 12 or 13 machine to where the project runs: Debian's packages (as root or through sudo), then .venv on
# top of Debian's Python. Does only what is missing, so every make target calls it; when all is there it takes a moment.
#     setup.sh               all that is needed to run, test and develop
#     setup.sh packages      Debian's packages only: the layer of a container image that changes least
#     setup.sh run           all that is needed to run: no test tools
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
unset PYTHONPATH PYTHONHOME PETSC_DIR PETSC_ARCH SLEPC_DIR # nothing from outside Debian and .venv gets in
export PYTHONNOUSERSITE=1 PIP_USER=0

# The C compiler is for DOLFINx, which compiles each form when it is first used; OpenBLAS halves the time of a solve;
# without EGL, pyvista crashes on a machine that has no screen; make is for what cannot be started by make.
packages=(
    make python3 python3-venv python3-dev gcc
    python3-dolfinx-real python3-gmsh python3-scipy python3-matplotlib
    openmpi-bin libopenblas0-pthread libegl1
)
debians=(numpy scipy matplotlib) # Debian's, which pip may not replace
python=/usr/bin/python3 # never the first on PATH: only Debian's sees Debian's DOLFINx
venv=.venv
stamp=$venv/setup-stamp
case ${1-} in
    "") extras='[dev]' ;;
    packages | run) extras= ;;
    *) printf 'set-up: no such part: %s (packages, run or nothing)\n' "$1" >&2; exit 2 ;;
esac

say() { printf 'set-up: %s\n' "$*" >&2; }
die() { say "$@"; exit 1; }

missing_packages() {
    # dpkg-query prints a line for each package it knows and fails if it does not know one: the lines are what counts.
    local installed package
    # shellcheck disable=SC2016  # the ${...} are dpkg-query's
    installed=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' "${packages[@]}" 2>/dev/null || true)
    for package in "${packages[@]}"; do
        grep -qx "installed $package" <<<"$installed" || printf '%s ' "$package"
    done
}

install_packages() {
    local root=() apt=(apt-get -q -y -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3)
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || die "these Debian packages are missing: $*. Install them as root" \
            "(apt-get install --no-install-recommends $*), or run this as root or with sudo at hand."
        root=(sudo)
    fi
    say "installing Debian packages (a minute or two): $*"
    "${root[@]}" "${apt[@]}" update >&2 || die "apt-get update failed; its message is above."
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive "${apt[@]}" install --no-install-recommends "$@" >&2 ||
        die "apt-get could not install: $*. The project needs Debian 12 or 13; apt's message is above."
}

wanted_stamp() {
    # Whatever changes one of these lines makes the Python packages be installed again.
    "$python" --version
    pwd
    printf 'extras: %s\n' "$extras"
    sha256sum pyproject.toml tools/setup.sh
}

debian_versions() {
    # pip may not replace what Debian's DOLFINx was built and tested with. Later ones of matplotlib-inline ask for what
    # Debian 12's Matplotlib has not.
    "$python" - "${debians[@]}" <<'PY'
import sys
from importlib.metadata import version

for name in sys.argv[1:]:
    print(f"{name}=={version(name)}")
print("matplotlib-inline<0.2")
PY
}

hold_versions() {
    # For whatever the user installs, too: without it pandas brings a NumPy that DOLFINx does not load with.
    debian_versions >$venv/debian-versions.txt
    local held # as a URL: pip parts a path at spaces
    held=$("$python" -c 'import pathlib, sys; print(pathlib.Path(sys.argv[1]).resolve().as_uri())' $venv/debian-versions.txt)
    printf '[install]\nconstraint = %s\n' "$held" >$venv/pip.conf
}

intruders() {
    # What stands in .venv before Debian's own.
    local name
    for name in "${debians[@]}"; do
        compgen -G "$venv/lib/python*/site-packages/$name" >/dev/null && printf '%s ' "$name"
    done
    true
}

fits() {
    # The virtual environment is on Debian's interpreter, of the present version, and sees Debian's packages.
    local minor
    minor=$("$python" -c 'import sys; print(f"{sys.version_info[0]}.{sys.version_info[1]}")')
    [ -x $venv/bin/python ] && grep -qx 'home = /usr/bin' $venv/pyvenv.cfg &&
        grep -qx 'include-system-site-packages = true' $venv/pyvenv.cfg && [ -d "$venv/lib/python$minor/site-packages/pip" ]
}

install_python() {
    say "installing Python packages into $venv (about a minute)"
    fits || "$python" -m venv --clear --system-site-packages $venv
    rm -f $stamp
    hold_versions
    read -ra others <<<"$(intruders)"
    [ ${#others[@]} -eq 0 ] || $venv/bin/python -m pip uninstall --quiet --yes "${others[@]}" ||
        die "pip could not remove ${others[*]} from $venv; its message is above."
    $venv/bin/python -m pip install --quiet --no-input --disable-pip-version-check --editable ".$extras" ||
        die "pip failed; its message is above. It needs to reach PyPI (or the mirror that pip is configured for)."
    OMPI_MCA_btl=self $venv/bin/python -c 'import dolfinx, gmsh, petsc4py, pydantic, pyvista' ||
        die "the installed packages do not work together; Python's message is above."
    wanted_stamp >$stamp
    say "done"
}

command -v dpkg-query >/dev/null || die "this needs Debian 12 or 13 (DOLFINx comes from its packages); no dpkg found here."
exec 9<tools/setup.sh # two make at once: the second waits, then finds all done
flock 9
read -ra missing <<<"$(missing_packages)"
[ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}" 9<&- # a service that apt starts must not keep the lock
[ "${1-}" != packages ] || exit 0
if [ "$(cat $stamp 2>/dev/null)" != "$(wanted_stamp)" ] || ! fits || [ -n "$(intruders)" ]; then
    install_python
fi
