#!/usr/bin/env bash
# Keeps the documented error reasons and the code equal: every value of amhex.v1.ErrorReason begins its
# comment with the status code it comes with, the server gives it somewhere, and no reason is given
# with a code that its comment does not name. Prints each offence; exit status 1 if there is any.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/../.."
awk '
  /^enum ErrorReason/ { inside = 1 }
  inside && /^  \/\// { sub(/^  \/\/ /, ""); comment = comment " " $0 }
  inside && /^  [A-Z_]+ = [0-9]+;/ { print $1 "\t" comment; comment = "" }
' proto/amhex/v1/errors.proto | grep -v '^ERROR_REASON_UNSPECIFIED' >"${TMPDIR:-/tmp}/reasons.$$"
trap 'rm -f "${TMPDIR:-/tmp}/reasons.$$"' EXIT

sources=$(cat server/src/*.cpp server/src/*.h server/src/worker/*.cpp | tr '\n' ' ' | tr -s ' ')
offences=0
while IFS=$'\t' read -r reason comment; do
  code=$(grep -oE '^ [A-Z_]+:' <<<"$comment" | tr -d ' :' || true)
  if [[ -z $code ]]; then
    echo "errors.proto: $reason: the comment does not begin with a status code"
    offences=1
    continue
  fi
  grep -qE "amhex::v1::$reason\b" <<<"$sources" ||
    { echo "errors.proto: $reason: the server never gives it"; offences=1; }
  # INVALID_ARGUMENT as absl spells it: kInvalidArgument.
  spelled=k$(sed -E 's/(^|_)([A-Z])([A-Z]*)/\2\L\3/g' <<<"$code")
  while read -r given; do
    [[ $given == "$spelled" || ($given == kOutOfRange && $reason == BAD_REQUEST) ]] ||
      { echo "errors.proto: $reason is $code, but the server gives it with $given"; offences=1; }
  done < <(grep -oE "MakeError\( ?absl::StatusCode::k[A-Za-z]+, amhex::v1::$reason\b" <<<"$sources" |
    grep -oE '::k[A-Za-z]+' | tr -d ':')
done <"${TMPDIR:-/tmp}/reasons.$$"
count=$(wc -l <"${TMPDIR:-/tmp}/reasons.$$")
((count > 0)) || { echo "errors.proto: no reasons were found"; exit 1; }
((offences == 0)) && echo "$count reasons are documented and given"
exit "$offences"
