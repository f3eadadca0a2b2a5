#!/bin/sh
# Fails if any file of a folder, text or binary, or any link in it, names one of the given paths.
#   names_no_folder.sh FOLDER PATH...
set -eu
folder=$1
shift
[ -d "$folder/include" ] || {
    echo "$folder is not an installed SDK"
    exit 1
}
for path; do
    if grep -rlaF -e "$path" "$folder" || find "$folder" -type l -lname "$path*" | grep .; then
        echo "name $path"
        exit 1
    fi
done
