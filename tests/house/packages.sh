# The Debian 12 packages that ./run and ./test need, and a function that installs them. Source this file.
packages_build="gcc g++ cmake ninja-build pkg-config libembree-dev libopenmesh-dev libjansson-dev
    libpng-dev libjpeg-dev libxxhash-dev libcmocka-dev libmeshoptimizer-dev"
packages_test="clang procps python3 clang-format-14 libclang-rt-14-dev qemu-user libfcl-dev"

# install_packages LOG PACKAGE...: installs the packages that are missing.
install_packages() {
    local log=$1 package missing=
    shift
    for package; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing="$missing $package"
    done
    [ -n "$missing" ] || return 0
    local sudo=
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { echo "missing packages, and neither root nor sudo to install them:$missing" >&2; return 1; }
        sudo=sudo
    fi
    echo "Installing:$missing"
    { $sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends $missing; } \
        >"$log" 2>&1 || { tail -n 20 "$log" >&2; echo "apt-get failed, see $log" >&2; return 1; }
}
