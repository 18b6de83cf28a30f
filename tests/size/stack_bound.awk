# SPDX-License-Identifier: MIT
# awk -v root=NAME -f stack_bound.awk POINTERS FILE.ci...: worst-case stack below function NAME, from what GCC writes with
# -fcallgraph-info=su. POINTERS says which functions calls through pointers reach. Prints the bound and the path, then
# whatever makes it no bound: recursion, frames that grow at run time, calls through pointers of which nothing is said.
# Functions of libraries that were not compiled so count 0 and are listed.
function name_of(title, parts, n) {
  n = split(title, parts, ":")
  sub(/C1E/, "C2E", parts[n])  # two names of one constructor, or destructor
  sub(/D1E/, "D2E", parts[n])
  return parts[n]
}
# Adds what is called through pointers as if it were called by name.
function resolve_pointers(node, i, other) {
  for (node in frame) {
    if (!((node, "__indirect_call") in known)) continue
    for (i = 1; i <= pointers; ++i) {
      if (node !~ caller[i]) continue
      known[node, "__indirect_call"] = 2
      if (target[i] != "-") for (other in frame) if (other ~ target[i]) callee[node, ++calls[node]] = other
    }
  }
}
function depth(node, i, n, to, below, best) {
  if (state[node] == 2) return total[node]
  if (state[node] == 1) { recursive[node] = 1; return 0 }
  if (!(node in frame)) { unknown[node] = 1; return 0 }
  state[node] = 1
  best = 0
  n = calls[node]
  for (i = 1; i <= n; ++i) {
    to = callee[node, i]
    if (to == "__indirect_call") {
      if (known[node, to] != 2) pointer[node] = 1
      continue
    }
    below = depth(to)
    if (below > best) { best = below; deepest[node] = to }
  }
  state[node] = 2
  return total[node] = frame[node] + best
}
FILENAME == ARGV[1] {
  sub(/#.*/, "")
  if (NF == 2) { caller[++pointers] = $1; target[pointers] = $2 }
  next
}
/^node:/ {
  match($0, /title: "[^"]*"/)
  node = name_of(substr($0, RSTART + 8, RLENGTH - 9))
  if (match($0, /[0-9]+ bytes \([a-z,]+\)/)) {
    split(substr($0, RSTART, RLENGTH), words, " ")
    frame[node] = words[1] + 0
    kind[node] = words[3]
  }
}
/^edge:/ {
  match($0, /sourcename: "[^"]*"/)
  from = name_of(substr($0, RSTART + 13, RLENGTH - 14))
  match($0, /targetname: "[^"]*"/)
  to = name_of(substr($0, RSTART + 13, RLENGTH - 14))
  if (!((from, to) in known)) {
    known[from, to] = 1
    callee[from, ++calls[from]] = to
  }
}
END {
  resolve_pointers()
  print "bound", depth(root)
  for (node = root; node != ""; node = deepest[node]) print "  " frame[node], node
  for (node in recursive) print "recursive", node
  for (node in pointer) print "pointer", node
  for (node in unknown) print "unknown", node
  for (node in state) if ((node in frame) && kind[node] != "(static)") print "dynamic", node, kind[node]
}
