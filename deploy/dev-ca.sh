#!/usr/bin/env bash
# A certificate authority for development, and certificates for coordinator, workers and clients:
#   bash deploy/dev-ca.sh DIR [HOST...]
# HOSTs are further names or addresses of the coordinator, beside localhost, 127.0.0.1 and ::1.
# DIR/ca.pem goes to every machine, NAME.pem and NAME.key to the one that runs NAME (server, worker or
# client); DIR/ca.key stays where it is. An authority that is there already is used again, and the
# three certificates are made anew: that is how they are renewed. For a farm that matters use an
# authority that is kept better than a file.
#
# DAYS: how long the certificates are valid (default 365). NAMES: which are made (default: all three);
# the name is also what the coordinator calls a peer without a token.
set -euo pipefail
umask 077

if [ $# -lt 1 ] || [ "${1#-}" != "$1" ]; then
  echo "usage: bash deploy/dev-ca.sh DIR [HOST...]" >&2
  exit 2
fi
folder=$1
shift
days=${DAYS:-365}
names=${NAMES:-server worker client}
mkdir -p "$folder"

alternatives="DNS:localhost,IP:127.0.0.1,IP:0:0:0:0:0:0:0:1"
for host in "$@"; do
  case $host in
    *:* | *[0-9].*[0-9].*[0-9].*[0-9]) alternatives="$alternatives,IP:$host" ;;
    *) alternatives="$alternatives,DNS:$host" ;;
  esac
done

# $1: file with the key; made unless it is there.
make_key() {
  [ -s "$1" ] || openssl ecparam -name prime256v1 -genkey -noout -out "$1"
}

if [ ! -s "$folder/ca.pem" ]; then
  make_key "$folder/ca.key"
  openssl req -x509 -new -key "$folder/ca.key" -sha256 -days 3650 -out "$folder/ca.pem" \
    -subj "/CN=Lucerna development authority" \
    -addext "basicConstraints=critical,CA:TRUE,pathlen:0" -addext "keyUsage=critical,keyCertSign,cRLSign"
fi

for name in $names; do
  case $name in
    server) extensions="extendedKeyUsage=serverAuth,clientAuth
subjectAltName=$alternatives" ;;
    *) extensions="extendedKeyUsage=clientAuth" ;;
  esac
  rm -f "$folder/$name.key.new"
  make_key "$folder/$name.key.new"
  openssl req -new -key "$folder/$name.key.new" -subj "/CN=$name" -out "$folder/$name.csr"
  openssl x509 -req -in "$folder/$name.csr" -CA "$folder/ca.pem" -CAkey "$folder/ca.key" \
    -set_serial "0x$(openssl rand -hex 16)" -days "$days" -sha256 -out "$folder/$name.pem.new" \
    -extfile <(printf 'basicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\n%s\n' "$extensions") \
    2>/dev/null
  # By renaming: a running program reads the old pair or the new one, but never half a file.
  mv "$folder/$name.key.new" "$folder/$name.key"
  mv "$folder/$name.pem.new" "$folder/$name.pem"
  rm "$folder/$name.csr"
done
chmod 644 "$folder/ca.pem"
for name in $names; do chmod 644 "$folder/$name.pem"; done
echo "certificates for: $names; in $folder"
