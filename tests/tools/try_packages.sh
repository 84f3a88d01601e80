#!/usr/bin/env bash
# Installs the Debian package in a bare Debian 12 and tries there, as a user, what docs/manual.md and docs/deploy.md say.
# One line for each item: pass, FAIL or skip. Ends with 1 when one fails.
#   try_packages.sh BASE PACKAGE [ITEM...]
# BASE: an image of Debian 12 that podman has; PACKAGE: what cpack made. ITEMs: only those whose names begin so. Needs podman
# as root and Debian's packages; 77 without podman. Screenshots and pictures are kept in the folder that is printed.
set -uo pipefail

only=()
wanted() {
  [ ${#only[@]} = 0 ] && return 0
  local prefix
  for prefix in "${only[@]}"; do [ "${1#"$prefix"}" != "$1" ] && return 0; done
  return 1
}
failed=0
# try ITEM COMMAND: COMMAND is a script for bash, of which every line must succeed; 77 skips.
try() {
  wanted "$1" || return 0
  local code=0
  bash -euo pipefail -c "$helpers"$'\n'"$2" > "$work/try.log" 2>&1 || code=$?
  case $code in
    0) echo "pass  $1" ;;
    77) echo "skip  $1: $(tail -n 1 "$work/try.log")" ;;
    *) echo "FAIL  $1"; sed 's/^/      /' "$work/try.log" | tail -n 15; failed=1 ;;
  esac
}

# What the items share. No tools beside those of a bare Debian: what they read of the network is read by bash and perl.
helpers='
cd "$work"
scene=$HOME/scenes/caustic.pbrt
small=(--size 48x36 --passes 4 --quiet)
fetch() { # HOST:PORT PATH
  exec 9<> "/dev/tcp/${1%:*}/${1##*:}"; printf "GET %s HTTP/1.0\r\nHost: %s\r\n\r\n" "$2" "$1" >&9; cat <&9; exec 9>&-
}
until_true() { for _ in $(seq 300); do "$@" > /dev/null 2>&1 && return 0; sleep 0.1; done; echo "never: $*"; return 1; }
started=()
trap "kill \${started[*]} 2> /dev/null || true; wait" EXIT
serve() { # flags of lucerna-server; sets at
  rm -f server.out
  lucerna-server --listen 127.0.0.1:0 "$@" > server.out 2> server.log & started+=($!)
  until_true grep -q "^listening on" server.out
  at=$(sed -n "s/^listening on //p" server.out); export LUCERNA_SERVER=$at
}
work_on() { rm -f worker.out; lucerna-worker --server "$at" --threads 1 "$@" > worker.out 2> worker.log & started+=($!); }
starts_with() { [ "$(head -c ${#2} "$1")" = "$2" ] || { echo "$1 does not begin with $2"; return 1; }; }
has() { grep "$@" > /dev/null; } # reads to the end: what writes must not be cut off
lacks() { if LC_ALL=C grep -q "$1" "$2"; then echo "$2 has $1"; return 1; fi; } # PATTERN FILE
fails() { # CODE COMMAND...: what it says stays on the standard error
  local wanted=$1 code=0; shift; "$@" || code=$?; [ "$code" = "$wanted" ] || { echo "exit code $code, not $wanted: $*"; return 1; }
}
'

# --- in the container, as a user without rights, with nothing but the package ------------------------------------------
as_user() {
  try 'render: lucerna SCENE' 'lucerna "$scene" "${small[@]}" && [ -s caustic.exr ]'
  try 'render: --png, --exposure and --tonemap, which leave the EXR as it is' '
    lucerna render "$scene" "${small[@]}" -o a.exr --png a.png --exposure 2 --tonemap filmic
    lucerna render "$scene" "${small[@]}" -o b.exr --png b.png --exposure 0 --tonemap clip
    [ "$(lucerna digest a.exr)" = "$(lucerna digest b.exr)" ] && ! cmp -s a.png b.png'
  try 'formats: .exr .png .pfm .hdr by the name, else an error' '
    for end in exr png pfm hdr; do lucerna render "$scene" "${small[@]}" -o "f.$end"; done
    starts_with f.exr v/1 || [ "$(od -An -tx1 -N4 f.exr | tr -d " ")" = 762f3101 ]
    [ "$(od -An -tx1 -N4 f.png | tr -d " ")" = 89504e47 ]
    starts_with f.pfm PF; starts_with f.hdr "#?RADIANCE"
    fails 2 lucerna render "$scene" "${small[@]}" -o f.tif 2>&1 | has "\.exr"'
  try 'formats: neither inputs nor files of others are replaced' '
    echo mine > mine.exr; cp "$scene" input.pbrt; cp -r "$HOME/scenes/meshes" . 2> /dev/null || true
    fails 2 lucerna render "$scene" "${small[@]}" -o mine.exr 2>&1 | has -- --force
    [ "$(cat mine.exr)" = mine ]; lucerna render "$scene" "${small[@]}" -o mine.exr --force; lucerna digest mine.exr'
  try 'png: --layer' 'lucerna render "$scene" "${small[@]}" -o l.exr
    for layer in direct photons albedo N Z noise; do lucerna png l.exr "l-$layer.png" --layer $layer; [ -s "l-$layer.png" ]; done'
  try 'png: --false-color' 'lucerna render "$scene" "${small[@]}" -o l.exr
    lucerna png l.exr density.png --false-color | has "dark blue is"
    lucerna png l.exr radius.png --layer radius --false-color --range 0.01,0.5'
  try 'tev: --tev against a listener' '
    perl -MIO::Socket::INET -e '\''my $s = IO::Socket::INET->new(LocalAddr => "127.0.0.1", LocalPort => 0, Listen => 1) or die;
      $| = 1; print $s->sockport, "\n"; my $c = $s->accept; my $n = 0; my $all = "";
      while (sysread($c, my $part, 65536)) { $all .= $part }
      my %packets; for (my $at = 0; $at + 5 <= length $all; $at += unpack("V", substr($all, $at, 4))) { $packets{ord substr($all, $at + 4, 1)}++ }
      print "created $packets{4}, updated $packets{5}\n"'\'' > tev.txt & listener=$!
    until_true test -s tev.txt
    lucerna render "$scene" "${small[@]}" -o t.exr --tev "127.0.0.1:$(head -n 1 tev.txt)"
    wait $listener; grep -q "created 1, updated [1-9]" tev.txt'
  try 'frames: --frames and ####' '
    for i in 0001 0002; do cp "$scene" "$HOME/scenes/room.$i.pbrt"; done
    lucerna render "$HOME/scenes/room.####.pbrt" --frames 1-2 -o "out.####.exr" "${small[@]}"
    [ -s out.0001.exr ] && [ -s out.0002.exr ]'
  try 'frames: several scenes' 'lucerna render "$scene" "$HOME/scenes/corner.pbrt" -o "several.##.exr" "${small[@]}"
    [ "$(ls several.*.exr | wc -l)" = 2 ]'
  try 'crop: tiles have their data window' '
    lucerna render "$scene" --size 48x36 --passes 4 --quiet --photons-per-pass 1728 --unguided -o whole.exr
    for part in 0,24,0,36 24,48,0,36; do
      lucerna render "$scene" --size 48x36 --passes 4 --quiet --photons-per-pass 1728 --unguided --crop $part -o "tile-${part%%,*}.exr"
    done'
  try 'render: --save-every writes the image so far, always whole' '
    lucerna render "$scene" --size 96x72 --time 8s --save-every 1s --quiet -o saved.exr & render=$!
    until_true test -s saved.exr; kill -0 $render
    for _ in 1 2 3; do lucerna digest saved.exr; sleep 0.7; done; kill -0 $render; wait $render'
  try 'render: interrupted by Ctrl-C, and --resume' '
    lucerna render "$scene" --size 48x36 --passes 400 --quiet -o undisturbed.exr
    set -m; lucerna render "$scene" --size 48x36 --passes 400 --quiet -o r.exr & render=$!
    sleep 1; kill -INT $render; code=0; wait $render || code=$?
    [ $code = 130 ] || [ $code = 0 ]
    lucerna render "$scene" --size 48x36 --passes 400 --quiet -o r.exr --resume
    [ "$(lucerna digest r.exr)" = "$(lucerna digest undisturbed.exr)" ]'
  try 'flags: --time 0.02m, --photons 10k, --max-memory 1G' '
    lucerna render "$scene" --size 48x36 --time 0.02m --quiet -o u.exr; lucerna render "$scene" --size 48x36 --photons 10k --quiet -o u.exr
    serve --max-memory 1G --max-job-bytes 512MiB'
  try 'flags: typos get suggestions' '
    fails 2 lucerna rendr "$scene" 2>&1 | has "did you mean render"
    fails 2 lucerna render "$scene" --exposur 2 2>&1 | has -- "--exposure"'
  try 'validate, plan, diff, digest, bake, selfcheck' '
    lucerna validate "$scene"; lucerna plan "$scene" | has "left out"
    lucerna render "$scene" "${small[@]}" -o d.exr; lucerna diff d.exr d.exr | has "RMSE  *0$"
    lucerna bake "$HOME/scenes/office.pbrt" -o office.glb --lux --passes 2 --spacing 0.5 --quiet; [ -s office.glb ]
    lucerna selfcheck --only extreme-inside-glass | has "^ok"'
  try 'compare: several scenes, to CSV' '
    for name in caustic corner; do lucerna render "$HOME/scenes/$name.pbrt" --size 24x16 --passes 32 --seed 9 --quiet -o "ref-$name.exr"; done
    lucerna compare "$scene" "$HOME/scenes/corner.pbrt" --reference ref-caustic.exr --reference ref-corner.exr --size 24x16 --times 0.2,0.4 \
      --repetitions 1 --settings "a: --alpha 0.5" --settings "k: --kernel constant" --csv points.csv --plot "plot-##.svg" -o table.md --quiet
    [ "$(wc -l < points.csv)" -ge 5 ] && [ -s plot-01.svg ] && [ -s plot-02.svg ]'
  try 'trace: --trace FILE.json' 'lucerna render "$scene" "${small[@]}" -o x.exr --trace trace.json; grep -q traceEvents trace.json'
  try 'trace-photon: .ply and .obj' 'serve; work_on; job=$(lucerna submit "$scene" "${small[@]}"); lucerna wait "$job" --quiet
    lucerna trace-photon "$job" 0:0-20 | has "caustic.pbrt:"
    lucerna trace-photon "$job" 0:0-999 -o photons.ply; starts_with photons.ply ply; lucerna trace-photon "$job" 0:0-99 -o ways.obj; [ -s ways.obj ]'
  try 'farm: jobs, workers, several names, priority, watch, fetch, report, drain' '
    serve --state state --jobs-at-once 1; first=$(lucerna submit "$scene" --size 48x36 --passes 4); second=$(lucerna submit "$scene" --size 48x36 --passes 4)
    lucerna jobs | has ETA; lucerna priority "$second" 5; lucerna pause "$first" "$second" --quiet; lucerna resume "$first" "$second" --quiet
    work_on; until_true lucerna workers --json
    lucerna wait "$first" --quiet; lucerna watch "$second" --quiet; lucerna fetch "$first" -o j.exr --png j.png
    lucerna report "$first" -o report.html --csv error.csv; grep -qi "<html" report.html
    worker=$(lucerna workers --json | sed -n "s/.*\"worker_id\": \"\(.*\)\".*/\1/p" | head -n 1)
    lucerna workers drain "$worker" --quiet; lucerna workers release "$worker" --quiet
    third=$(lucerna submit "$scene" --time 5m); lucerna cancel "$third" --quiet || true
    lucerna delete "$first" "$second" --quiet; lucerna jobs > jobs.txt; lacks "$first" jobs.txt'
  try 'farm: a worker that is killed, and a coordinator that is started again, leave the image as it is' '
    lucerna render "$scene" --size 48x36 --passes 300 --quiet -o alone.exr
    serve --state again; work_on; victim=${started[-1]}; work_on
    job=$(lucerna submit "$scene" --size 48x36 --passes 300); sleep 0.5; kill -KILL "$victim"; kill -TERM "${started[0]}"; wait "${started[0]}"
    lucerna-server --listen "$at" --state again > server.out 2>> server.log & started+=($!)
    lucerna wait "$job" --quiet; lucerna fetch "$job" -o farm.exr --quiet
    [ "$(lucerna digest farm.exr)" = "$(lucerna digest alone.exr)" ]'
  try 'logs: JSON, and text' 'serve --log-format json; work_on --log-format json; lucerna submit "$scene" "${small[@]}" -o lj.exr
    for log in server.log worker.log; do [ -s $log ]; lacks "^[^{]" $log; lacks "[^}]$" $log; done'
  try 'metrics: of coordinator and worker' 'serve --metrics 127.0.0.1:0; work_on --metrics 127.0.0.1:0
    lucerna submit "$scene" "${small[@]}" -o m.exr
    page() { fetch "$(sed -n "s|^metrics at http://\(.*\)/metrics|\1|p" "$1")" /metrics; }
    until_true grep -q "^metrics at" worker.out
    page server.out | tr -d "\r" | sed "1,/^$/d" > "$HOME/coordinator.metrics"; grep -q "^lucerna_jobs{state=\"succeeded\"} 1" "$HOME/coordinator.metrics"
    page worker.out | tr -d "\r" | sed "1,/^$/d" > "$HOME/worker.metrics"; grep -q "^lucerna_worker_connected 1" "$HOME/worker.metrics"'
  try 'page: --web' 'serve --web 127.0.0.1:0; work_on; lucerna submit "$scene" "${small[@]}" -o w.exr
    page=$(sed -n "s|^page at http://\(.*\)/|\1|p" server.out); fetch "$page" / > page.html; grep -qi "<html" page.html
    lacks "\(src\|href\)=.\?https\?://" page.html'
  try 'terminal: curve and image by the locale, no image with NO_COLOR' '
    seen() { script -qec "$*" /dev/null < /dev/null; }
    run="lucerna render $scene --size 48x36 --time 3s --error 0.01% -o term.exr --force"
    export TERM=xterm-256color COLORTERM=truecolor
    LC_ALL=C.UTF-8 seen "$run" > utf8; grep -q "▀" utf8
    LC_ALL=C seen "$run" > ascii; lacks "[^ -~[:cntrl:]]" ascii; grep -q "48;2;" ascii; LC_ALL=C grep -q -- "----" ascii
    NO_COLOR=1 LC_ALL=C.UTF-8 seen "$run" > plain; lacks "48;2;" plain; grep -q "error about" plain'
  try 'configuration: ~/.config/lucerna.toml, below flags, and LUCERNA_SERVER' '
    mkdir -p "$HOME/.config"; printf "[render]\nsize = \"30x20\"\npasses = 3\n" > "$HOME/.config/lucerna.toml"
    trap "rm -f $HOME/.config/lucerna.toml" EXIT
    lucerna render "$scene" -o c.exr --json | has "\"passes\": 3"
    lucerna render "$scene" -o c.exr --passes 2 --json | has "\"passes\": 2"
    LUCERNA_SERVER=127.0.0.1:1 fails 3 lucerna jobs 2>&1 | has 127.0.0.1:1'
  try 'installed: completion of bash' '
    source /usr/share/bash-completion/completions/lucerna; complete -p lucerna
    COMP_WORDS=(lucerna ren); COMP_CWORD=1; COMP_LINE="lucerna ren"; COMP_POINT=11
    "$(complete -p lucerna | sed "s/.*-F \([^ ]*\).*/\1/")"; [ "${COMPREPLY[0]% }" = render ]'
  try 'installed: manual, pages, schemas, units, deploy' '
    for file in man/man1/lucerna.1.gz man/man1/lucerna-server.1.gz man/man1/lucerna-worker.1.gz doc/lucerna/manual.md doc/lucerna/deploy.md \
      doc/lucerna/schemas/job.schema.json lucerna/deploy/slurm/workers.sbatch lucerna/deploy/kubernetes/workers.yaml lucerna/deploy/monitoring/alerts.yml; do
      [ -s "/usr/share/$file" ] || [ -s "/usr/share/${file%.gz}" ] || { echo "/usr/share/$file is missing"; exit 1; }
    done
    [ -s /lib/systemd/system/lucerna-server.service ] && [ -s /lib/systemd/system/lucerna-worker.service ]'
}

# --- in the container, as root, with further packages of Debian ----------------------------------------------------------
needs() { # packages
  DEBIAN_FRONTEND=noninteractive apt-get install --yes --quiet --no-install-recommends "$@" > "$work/apt.log" 2>&1 || { tail -n 5 "$work/apt.log"; return 1; }
}
export -f needs
as_root() {
  try 'installed: man lucerna' 'needs man-db groff-base; man -P cat lucerna > page; grep -q -- --exposure page; grep -q LC_ALL page; man -P cat lucerna-worker | has -- --threads'
  try 'systemd: systemd-analyze verify' 'needs systemd; for unit in lucerna-server lucerna-worker; do
    said=$(systemd-analyze verify --man=no "/lib/systemd/system/$unit.service" 2>&1); [ -z "$said" ] || { echo "$said"; exit 1; }; done'
  try 'farm: certificates of dev-ca.sh, and tokens' '
    needs openssl; bash /usr/share/lucerna/deploy/dev-ca.sh ca; umask 077
    lucerna token new alice --roles submit > alice; sed -n 2p alice > alice.token; sed -n 4p alice > tokens
    lucerna token new farm --roles work > farm; sed -n 2p farm > farm.token; sed -n 4p farm >> tokens
    serve --tokens tokens --tls-ca ca/ca.pem --tls-cert ca/server.pem --tls-key ca/server.key
    work_on --token-file farm.token --tls-ca ca/ca.pem --tls-cert ca/worker.pem --tls-key ca/worker.key
    fails 1 lucerna jobs 2> refused || fails 3 lucerna jobs
    export LUCERNA_TLS_CA=ca/ca.pem LUCERNA_TLS_CERT=ca/client.pem LUCERNA_TLS_KEY=ca/client.key LUCERNA_TOKEN=$(cat alice.token)
    lucerna submit "$scene" "${small[@]}" -o secure.exr; lucerna jobs | has alice'
  try 'metrics: promtool on the pages, the alerts and their tests' 'needs prometheus
    promtool check metrics < /home/artist/coordinator.metrics; promtool check metrics < /home/artist/worker.metrics
    cp -r /usr/share/lucerna/deploy/monitoring rules; cd rules; promtool check rules alerts.yml; promtool test rules alerts_test.yml; promtool check config prometheus.yml'
  try 'JSON: what commands print follows the schemas' 'needs python3 python3-jsonschema
    diff -r /source/docs/schemas /usr/share/doc/lucerna/schemas; python3 /source/tests/tools/check_schemas.py /usr/bin'
  try 'Python: pip install, and the page docs/python.md as it is' '
    needs python3-venv python3-grpcio python3-protobuf python3-numpy protobuf-compiler protobuf-compiler-grpc libprotobuf-dev
    mkdir -p copy; cp -r /source/client /source/proto /source/CMakeLists.txt /source/LICENSE copy; python3 -m venv --system-site-packages env; env/bin/pip install --quiet copy/client/python
    python3 /source/tests/python/client_test.py /usr/bin InstallationTest JobsTest.test_the_page_of_the_manual_runs_as_it_is \
      JobsTest.test_a_reference_tells_true_errors_and_its_noise_and_settings_are_compared'
  try 'Python: tiles stitch to the whole image' '
    cat > stitch.py <<"PY"
import numpy as np, lucerna
folder = "/home/artist/work"
whole, left, right = (lucerna.read_image(f"{folder}/{name}.exr") for name in ("whole", "tile-0", "tile-24"))
for layer in ("albedo", "N", "Z", "direct"):
    stitched = np.concatenate([left[layer], right[layer]], axis=1)
    assert np.array_equal(stitched, whole[layer], equal_nan=True), layer
PY
    env/bin/python stitch.py'
  try 'Python: the notebook' 'needs python3-ipykernel python3-nbclient python3-nbformat
    python3 /source/tests/python/client_test.py /usr/bin JobsTest.test_the_notebook_runs_and_draws_a_curve_for_each_controller'
  try 'Slurm: one node; preempted, 1 to 3 to 1 workers, the same image' 'needs slurm-wlm munge; bash /source/tests/tools/try_slurm.sh /usr/bin'
}

if [ "${1:-}" = --inside ]; then
  part=$2
  shift 2
  only=("$@")
  work=$HOME/work
  mkdir -p "$work"
  export work
  "$part"
  exit $failed
fi

# --- on the machine -----------------------------------------------------------------------------------------------------
[ $# -ge 2 ] || { sed -n '2,6p' "$0"; exit 2; }
base=$1 package=$(realpath "$2")
shift 2
only=("$@")
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
command -v podman > /dev/null || { echo "podman is not installed: the package was not tried"; exit 77; }
podman image exists "$base" || { echo "podman has no image $base: the package was not tried"; exit 77; }
export work=$(mktemp -d) root
container=$(podman run --detach --network host --volume "$root:/source:ro" "$base" sleep infinity)
export container
trap 'podman rm --force --time 5 "$container" > /dev/null; echo "pictures and logs: $work"' EXIT
run() { podman exec "$@"; }

podman cp "$package" "$container:/tmp/lucerna.deb"
helpers=
try 'install: apt-get install ./lucerna.deb' '
  podman exec "$container" apt-get update --quiet
  podman exec --env DEBIAN_FRONTEND=noninteractive "$container" apt-get install --yes --quiet --no-install-recommends /tmp/lucerna.deb
  podman exec "$container" lucerna --version'
run "$container" sh -c 'id artist > /dev/null 2>&1 || useradd --create-home --shell /bin/bash artist; [ -e /home/artist/scenes ] || { cp -r /source/tests/scenes /home/artist/scenes; chown -R artist /home/artist; ln -s /home/artist/scenes /root/scenes; }
  command -v lucerna > /dev/null || apt-get install --yes --quiet --no-install-recommends /tmp/lucerna.deb > /dev/null 2>&1'
inside() { # USER PART: its lines, and whether all passed
  local home=/root
  [ "$1" = root ] || home=/home/$1
  run --user "$1" --env HOME="$home" --workdir "$home" "$container" bash /source/tests/tools/try_packages.sh --inside "$2" "${only[@]}" || failed=1
}
inside artist as_user
inside root as_root

# With tools of this machine, on what the package holds.
dpkg-deb --extract "$package" "$work/package"
try 'page: in headless Chromium' '
  command -v chromium > /dev/null || { echo "chromium is not installed"; exit 77; }
  bin=$work/package/usr/bin; cd "$work"
  podman exec --user artist --workdir /home/artist "$container" sh -c "lucerna-server --listen 127.0.0.1:17411 --web 127.0.0.1:17412 & lucerna-worker --server 127.0.0.1:17411 --threads 1 &
    lucerna submit scenes/caustic.pbrt --size 320x240 --passes 40 --server 127.0.0.1:17411 -o /tmp/shot.exr --quiet" & sleep 12
  timeout 60 chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1280,1400 --virtual-time-budget=8000 \
    --screenshot="$work/page.png" http://127.0.0.1:17412/ > chromium.log 2>&1
  [ -s "$work/page.png" ]'
try 'Kubernetes: manifests, against the programs' 'python3 "$root/tests/tools/check_kubernetes.py" "$root" "$work/package/usr/bin"
  diff -r "$root/deploy/kubernetes" "$work/package/usr/share/lucerna/deploy/kubernetes"'
try 'Blender: exported by client/blender/room.py and rendered by the package' '
  command -v blender > /dev/null || { echo "blender is not installed"; exit 77; }
  PATH=/usr/bin:$PATH blender --background --factory-startup --python "$root/client/blender/room.py" -- "$work/room.glb"
  podman cp "$work/room.glb" "$container:/home/artist/room.glb"
  podman exec --user artist --workdir /home/artist "$container" lucerna render room.glb --size 120x120 --passes 32 --max-depth 10 -o room.exr --png room.png --quiet
  podman cp "$container:/home/artist/room.png" "$work/room.png"'
for picture in a.png l-noise.png density.png radius.png j.png; do
  podman cp "$container:/home/artist/work/$picture" "$work/$picture" 2> /dev/null || true
done
exit $failed
