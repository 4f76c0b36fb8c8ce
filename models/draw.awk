# Draws the mechanism of a scene at its start values as SVG:
#   awk -f draw.awk SCENE.toml > drawing.svg
#   awk -v width=800 -v side=90 -v labels=0 -f draw.awk SCENE.toml > drawing.svg
# width and side: pixels of the page and of its left and right margin; labels: whether names are written.
# Knows points, bars, bodies, masses, springs, rods, pins, drivers of x or y, forces and couples; what it does not know,
# it leaves out.
# Reads the plain subset of TOML that the scenes here are written in: one key a line.

function text(value) { sub(/^"/, "", value); sub(/"$/, "", value); return value }

function value_of(path, otherwise) { return (path in value) ? value[path] : otherwise }
function number(path) { return (path in value) ? value[path] + 0 : 0 }

function locate(name, path, on, along, across, c, s, i, j, length_) {
  if (name in X) return
  path = "point." name
  on = text(value_of(path ".on", ""))
  along = number(path ".x_m"); across = number(path ".y_m")
  if (on == "") { X[name] = along; Y[name] = across }
  else if (("body." on ".x_m") in value) {
    c = cos(number("body." on ".angle_rad")); s = sin(number("body." on ".angle_rad"))
    X[name] = number("body." on ".x_m") + c * along - s * across
    Y[name] = number("body." on ".y_m") + s * along + c * across
  } else {
    i = text(value["bar." on ".from"]); j = text(value["bar." on ".to"])
    locate(i); locate(j)
    length_ = sqrt((X[j] - X[i]) ^ 2 + (Y[j] - Y[i]) ^ 2)
    c = (X[j] - X[i]) / length_; s = (Y[j] - Y[i]) / length_
    X[name] = X[i] + c * along - s * across
    Y[name] = Y[i] + s * along + c * across
  }
}

function px(x) { return sprintf("%.1f", side + (x - xmin) * scale) }
function py(y) { return sprintf("%.1f", margin + (ymax - y) * scale) }

function line(x1, y1, x2, y2, style) {
  printf "<line x1=\"%s\" y1=\"%s\" x2=\"%s\" y2=\"%s\" %s/>\n", x1, y1, x2, y2, style
}
function circle(x, y, r, style) { printf "<circle cx=\"%s\" cy=\"%s\" r=\"%s\" %s/>\n", x, y, r, style }
function label(x, y, what, style) {
  if (labels) printf "<text x=\"%.1f\" y=\"%.1f\" %s>%s</text>\n", x, y + 5, style, what
}

# A zigzag of 12 half-waves between two points on the page.
function zigzag(x1, y1, x2, y2, style, l, ux, uy, k, f, side, d) {
  l = sqrt((x2 - x1) ^ 2 + (y2 - y1) ^ 2)
  if (l < 1) return
  ux = (x2 - x1) / l; uy = (y2 - y1) / l
  d = sprintf("M%.1f %.1f", x1, y1)
  for (k = 0; k <= 12; k++) {
    f = 0.15 + 0.7 * k / 12
    side = (k == 0 || k == 12) ? 0 : (k % 2 ? 7 : -7)
    d = d sprintf(" L%.1f %.1f", x1 + f * l * ux - side * uy, y1 + f * l * uy + side * ux)
  }
  printf "<path d=\"%s L%.1f %.1f\" %s/>\n", d, x2, y2, style
}

# Where a text stands: beside (x, y) in the direction (dx, dy) on the page, clear of what is there.
function beside(x, y, dx, dy, off, what, style, l, anchor) {
  l = sqrt(dx * dx + dy * dy)
  if (l == 0) { dx = 0; dy = -1; l = 1 }
  dx /= l; dy /= l
  anchor = dx > 0.4 ? "start" : (dx < -0.4 ? "end" : "middle")
  label(x + off * dx, y + (off + 3) * dy, what, style " text-anchor=\"" anchor "\"")
}

# The name of an element beside its line, away from the middle of the drawing.
function name_line(i, j, what, style, x1, y1, x2, y2, nx, ny) {
  x1 = px(X[i]); y1 = py(Y[i]); x2 = px(X[j]); y2 = py(Y[j])
  if ((x2 - x1) ^ 2 + (y2 - y1) ^ 2 < 1600) return
  nx = -(y2 - y1); ny = x2 - x1
  if (((x1 + x2) / 2 - px(xc)) * nx + ((y1 + y2) / 2 - py(yc)) * ny < 0) { nx = -nx; ny = -ny }
  beside(0.6 * x1 + 0.4 * x2, 0.6 * y1 + 0.4 * y2, nx, ny, 12, what, style)
}

function arrow(x1, y1, x2, y2, style, l, ux, uy) {
  l = sqrt((x2 - x1) ^ 2 + (y2 - y1) ^ 2); ux = (x2 - x1) / l; uy = (y2 - y1) / l
  line(x1, y1, x2, y2, style)
  printf "<path d=\"M%.1f %.1f L%.1f %.1f L%.1f %.1f z\" fill=\"#a3195b\"/>\n", x2 + 4 * ux, y2 + 4 * uy, \
    x2 - 9 * ux - 4 * uy, y2 - 9 * uy + 4 * ux, x2 - 9 * ux + 4 * uy, y2 - 9 * uy - 4 * ux
}

BEGIN { if (width == "") width = 640; if (labels == "") labels = 1; if (margin == "") margin = 48; if (side == "") side = margin }

/^\[\[/ { section = ""; next }
/^\[/ {
  section = $0; gsub(/[\[\] ]/, "", section)
  split(section, part, ".")
  if (part[2] != "") { kind[++count] = part[1]; name[count] = part[2] }
  next
}
/^[A-Za-z_]/ && section != "" {
  at = index($0, "=")
  key = substr($0, 1, at - 1); gsub(/ /, "", key)
  entry = substr($0, at + 1); sub(/^ +/, "", entry); sub(/ +$/, "", entry)
  value[section "." key] = entry
}

END {
  for (i = 1; i <= count; i++) if (kind[i] == "point") {
    locate(name[i])
    points++; xc += X[name[i]]; yc += Y[name[i]]
    if (points == 1) { xmin = xmax = X[name[i]]; ymin = ymax = Y[name[i]] }
    if (X[name[i]] < xmin) xmin = X[name[i]]
    if (X[name[i]] > xmax) xmax = X[name[i]]
    if (Y[name[i]] < ymin) ymin = Y[name[i]]
    if (Y[name[i]] > ymax) ymax = Y[name[i]]
  }
  if (!points) { print "draw.awk: the scene has no points" > "/dev/stderr"; exit 1 }
  xc /= points; yc /= points
  span = xmax - xmin
  if (ymax - ymin > span) span = ymax - ymin
  scale = (width - 2 * side) / span
  w = (xmax - xmin) * scale + 2 * side; h = (ymax - ymin) * scale + 2 * margin
  printf "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\" ", w, h, w, h
  print "font-family=\"Helvetica, Arial, sans-serif\" font-size=\"15\">"
  printf "<rect width=\"%.0f\" height=\"%.0f\" fill=\"#ffffff\"/>\n", w, h

  # Bodies: the polygon of their points, in the order of the scene; a thick line where these lie on one.
  for (b = 1; b <= count; b++) if (kind[b] == "body") {
    corners = ""; n = 0; sx = sy = area = 0
    for (i = 1; i <= count; i++) if (kind[i] == "point" && text(value_of("point." name[i] ".on", "")) == name[b]) {
      corners = corners sprintf("%s %s ", px(X[name[i]]), py(Y[name[i]]))
      if (++n == 1) first[b] = name[i]
      else area += (X[last[b]] - X[first[b]]) * (Y[name[i]] - Y[first[b]]) - (Y[last[b]] - Y[first[b]]) * (X[name[i]] - X[first[b]])
      sx += X[name[i]]; sy += Y[name[i]]; last[b] = name[i]
    }
    if (n == 0) continue
    flat[b] = area < 0.01 * span * span && area > -0.01 * span * span
    printf "<polygon points=\"%s\" fill=\"#c9d8ea\" fill-opacity=\"0.7\" stroke=\"#4a6fa5\" stroke-width=\"%s\" stroke-linejoin=\"round\"/>\n", corners, (flat[b] ? 7 : 3)
    body_x[b] = sx / n; body_y[b] = sy / n
  }
  for (e = 1; e <= count; e++) {
    path = kind[e] "." name[e]
    i = text(value_of(path ".from", "")); j = text(value_of(path ".to", ""))
    if (kind[e] == "bar" || kind[e] == "distance") {
      style = (kind[e] == "bar" && number(path ".mass_kg") > 0) ? "stroke=\"#4a6fa5\" stroke-width=\"8\" stroke-linecap=\"round\"" : "stroke=\"#4a6fa5\" stroke-width=\"3\""
      line(px(X[i]), py(Y[i]), px(X[j]), py(Y[j]), style)
    }
    if (kind[e] == "spring" || kind[e] == "maxwell")
      zigzag(px(X[i]), py(Y[i]), px(X[j]), py(Y[j]), "fill=\"none\" stroke=\"#c8641e\" stroke-width=\"2\" stroke-linejoin=\"round\"")
  }
  # Ground: a triangle with hatching.
  for (i = 1; i <= count; i++) if (kind[i] == "point" && value_of("point." name[i] ".ground", "") == "true") {
    x = px(X[name[i]]); y = py(Y[name[i]])
    printf "<path d=\"M%.1f %.1f l-10 17 h20 z\" fill=\"#eeeeee\" stroke=\"#555555\" stroke-width=\"1.5\"/>\n", x, y
    for (k = -2; k <= 2; k++) line(x + 5 * k + 2, y + 17, x + 5 * k - 3, y + 23, "stroke=\"#555555\" stroke-width=\"1.2\"")
  }
  for (e = 1; e <= count; e++) {
    path = kind[e] "." name[e]
    if (kind[e] == "mass") {
      i = text(value[path ".point"])
      circle(px(X[i]), py(Y[i]), 12, "fill=\"#4a6fa5\"")
      heavy[px(X[i]) "," py(Y[i])] = 1
    }
    if (kind[e] == "force") {
      i = text(value[path ".point"])
      fx = number(path ".x_N"); fy = number(path ".y_N")
      if (fx == 0 && fy == 0) fx = 1
      l = sqrt(fx * fx + fy * fy)
      pulled[px(X[i]) "," py(Y[i])] = 1
      arrow(px(X[i]), py(Y[i]), px(X[i]) + 40 * fx / l, py(Y[i]) - 40 * fy / l, "stroke=\"#a3195b\" stroke-width=\"3\"")
    }
    # A coordinate held by a constant is a rail, a driven one moves to and fro.
    if (kind[e] == "driver") {
      split(text(value_of(path ".coordinate", "")), part, ".")
      b = part[1]
      if (("body." b ".x_m") in value) { x = px(number("body." b ".x_m")); y = py(number("body." b ".y_m")) }
      else if (b in X) { x = px(X[b]); y = py(Y[b]) }
      else continue
      dx = part[2] == "y" ? 0 : 1
      if (value_of(path ".law", "") !~ /[{]/) {
        printf "<rect x=\"%.1f\" y=\"%.1f\" width=\"24\" height=\"16\" fill=\"#c9d8ea\" stroke=\"#4a6fa5\" stroke-width=\"2\"/>\n", x - 12, y - 8
        for (k = -1; k <= 1; k += 2)
          line(x - (dx ? 10 * k : 45), y - (dx ? 45 : 10 * k), x + (dx ? -10 * k : 45), y + (dx ? 45 : -10 * k), "stroke=\"#555555\" stroke-width=\"1.5\"")
      } else {
        arrow(x, y, x + 34 * dx, y - 34 * (1 - dx), "stroke=\"#a3195b\" stroke-width=\"2.5\"")
        arrow(x, y, x - 34 * dx, y + 34 * (1 - dx), "stroke=\"#a3195b\" stroke-width=\"2.5\"")
      }
    }
    if (kind[e] == "couple") {
      b = text(value_of(path ".angle", ""))
      if (("body." b ".x_m") in value) {
        x = px(value["body." b ".x_m"]); y = py(value["body." b ".y_m"])
        printf "<path d=\"M%.1f %.1f a20 20 0 1 0 -20 -20\" fill=\"none\" stroke=\"#a3195b\" stroke-width=\"2.5\"/>\n", x, y + 20
        printf "<path d=\"M%.1f %.1f l-4 -10 l9 1 z\" fill=\"#a3195b\"/>\n", x - 21, y + 6
      }
    }
  }
  for (i = 1; i <= count; i++) if (kind[i] == "point")
    circle(px(X[name[i]]), py(Y[name[i]]), 4.5, "fill=\"#ffffff\" stroke=\"#222222\" stroke-width=\"1.8\"")

  # Names: of points away from the middle of the drawing, once a place; of elements beside them.
  for (e = 1; e <= count; e++) {
    path = kind[e] "." name[e]
    i = text(value_of(path ".from", "")); j = text(value_of(path ".to", ""))
    if (kind[e] == "bar") name_line(i, j, name[e], "fill=\"#2c4a77\"")
    if (kind[e] == "spring" || kind[e] == "maxwell") name_line(i, j, name[e], "fill=\"#a34d12\"")
    if (!(e in body_x)) continue
    if (flat[e]) name_line(first[e], last[e], name[e], "fill=\"#2c4a77\"")
    else label(px(body_x[e]), py(body_y[e]), name[e], "fill=\"#2c4a77\" text-anchor=\"middle\"")
  }
  for (i = 1; i <= count; i++) if (kind[i] == "point") {
    place = px(X[name[i]]) "," py(Y[name[i]])
    if (place in named) continue
    named[place] = 1
    ground = value_of("point." name[i] ".ground", "") == "true"
    dx = X[name[i]] - xc; dy = -(Y[name[i]] - yc)
    if (ground && dy > 0) dx = 0  # below the bearing's triangle
    if (place in pulled) { dx = 0; dy = 1 }
    beside(px(X[name[i]]), py(Y[name[i]]), dx, dy, (place in heavy) ? 17 : (ground && dy > 0 ? 33 : 12), name[i], "fill=\"#222222\" font-weight=\"bold\"")
  }
  print "</svg>"
}
