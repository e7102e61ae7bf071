#!/usr/bin/env bash
# Writes what an image consists of as SPDX 2.3 (JSON): amhex and every Debian package, with version
# and source package. For the last stage of a Dockerfile; needs nothing but dpkg.
#
#   deploy/make-sbom.sh NAME REVISION >sbom.spdx.json
set -euo pipefail

if [[ $# -ne 2 ]]; then sed -n '2,5s/^# \{0,1\}//p' "$0" >&2; exit 2; fi
name=$1
revision=$2

# JSON strings: dpkg's fields hold no control characters, only quotes and backslashes matter.
escape() { sed 's/\\/\\\\/g; s/"/\\"/g' <<<"$1"; }

cat <<END
{
  "spdxVersion": "SPDX-2.3",
  "dataLicense": "CC0-1.0",
  "SPDXID": "SPDXRef-DOCUMENT",
  "name": "$(escape "$name")",
  "documentNamespace": "https://spdx.org/spdxdocs/$(escape "$name")-$(cat /proc/sys/kernel/random/uuid)",
  "creationInfo": {
    "created": "$(date -u +%Y-%m-%dT%H:%M:%SZ)",
    "creators": ["Tool: make-sbom.sh"]
  },
  "packages": [
    {
      "SPDXID": "SPDXRef-amhex",
      "name": "amhex",
      "versionInfo": "$(escape "$revision")",
      "licenseDeclared": "Apache-2.0",
      "licenseConcluded": "Apache-2.0",
      "copyrightText": "NOASSERTION",
      "downloadLocation": "NOASSERTION"
    }
END
dpkg-query -W -f '${Package}\t${Version}\t${Architecture}\t${source:Package}\t${source:Version}\n' |
  while IFS=$'\t' read -r package version architecture source source_version; do
    cat <<END
    ,{
      "SPDXID": "SPDXRef-deb-$package-$architecture",
      "name": "$package",
      "versionInfo": "$version",
      "sourceInfo": "built from $source $source_version",
      "licenseDeclared": "NOASSERTION",
      "licenseConcluded": "NOASSERTION",
      "copyrightText": "NOASSERTION",
      "downloadLocation": "NOASSERTION",
      "externalRefs": [{
        "referenceCategory": "PACKAGE-MANAGER",
        "referenceType": "purl",
        "referenceLocator": "pkg:deb/debian/$package@${version//+/%2B}?arch=$architecture&distro=bookworm"
      }]
    }
END
  done
cat <<END
  ],
  "relationships": [
    {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": "SPDXRef-amhex"}
  ]
}
END
