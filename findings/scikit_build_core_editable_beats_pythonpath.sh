#!/usr/bin/env bash
# scikit-build-core 1.1.2: a package installed editable is imported from there even if PYTHONPATH,
# the current directory and sys.path[0] all name another checkout of it.
#
# Expected: an editable install is like an entry at the end of sys.path (which is what setuptools
# makes of a src layout, and what a .pth file is for), so PYTHONPATH comes first. Comparing two
# revisions by `PYTHONPATH=../other python bench.py`, or mutating a copy and running its tests, is
# usual.
#
# What happens: a finder is put at the head of sys.meta_path, in front of the one that knows
# sys.path. It knows the files of the checkout that was installed, and is asked first. The other
# checkout is never looked at: the benchmark compares a revision with itself and the mutants all
# survive. Nothing on the way says so; `kern.__file__` does. The mode "inplace", which adds the
# source folder to sys.path as well, makes no difference. A venv for each checkout does.
#
# Seen:
#   redirect:   PYTHONPATH gives installed, current directory gives installed
#   inplace:    PYTHONPATH gives installed, current directory gives installed
#   setuptools: PYTHONPATH gives other, current directory gives other
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for checkout in installed other; do
    mkdir -p "$work/$checkout/src/kern"
    echo "WHERE = '$checkout'" > "$work/$checkout/src/kern/__init__.py"
done

project() { # BUILD-SYSTEM [TABLE]
    cat > "$work/installed/pyproject.toml" <<EOF
[build-system]
$1
[project]
name = "kern"
version = "1"
$2
EOF
}
scikit='requires = ["scikit-build-core==1.1.2"]
build-backend = "scikit_build_core.build"'
setuptools='requires = ["setuptools==80.9.0"]
build-backend = "setuptools.build_meta"'
table='[tool.scikit-build]
wheel.cmake = false
wheel.packages = ["src/kern"]'

show='import kern; print(kern.WHERE)'
try() { # NAME
    python3 -m venv "$work/$1"
    "$work/$1/bin/pip" install -q --disable-pip-version-check --no-cache-dir -e "$work/installed"
    by_path=$(PYTHONPATH="$work/other/src" "$work/$1/bin/python" -c "$show")
    by_folder=$(cd "$work/other/src" && "$work/$1/bin/python" -c "$show")
    printf '%-11s PYTHONPATH gives %s, current directory gives %s\n' "$1:" "$by_path" "$by_folder"
}
project "$scikit" "$table"
redirect=$(try redirect)
project "$scikit" "$table
editable.mode = \"inplace\""
inplace=$(try inplace)
project "$setuptools" ""
plain=$(try setuptools)
printf '%s\n' "$redirect" "$inplace" "$plain"
[[ $redirect == *"gives installed, "*"gives installed" ]]
[[ $inplace == *"gives installed, "*"gives installed" ]]
[[ $plain == *"gives other, "*"gives other" ]]
