#include "page_script.h"

namespace costate::app {

std::string script_element(const std::string& program, const std::string& id) {
  return (id.empty() ? "<script>" : "<script id=\"" + id + "\">") + "//<![CDATA[\n" + program + "\n//]]></script>\n";
}

std::string script_data(std::string json) {
  // In strings of JSON these are the same characters; outside of strings there are none.
  for (const auto& [character, code] : {std::pair('<', "\\u003c"), {'>', "\\u003e"}, {'&', "\\u0026"}})
    for (std::size_t at = 0; (at = json.find(character, at)) != std::string::npos; at += 6) json.replace(at, 1, code);
  return json;
}

const char* plot_style() {
  return ".plots svg { cursor: crosshair; user-select: none; }\n"
         "#reading { position: fixed; pointer-events: none; background: #ffffffee; border: 1px solid #888888; padding: "
         "0.2em 0.5em; font-size: 0.8em; white-space: pre; font-variant-numeric: tabular-nums; }\n";
}

const char* plot_script() {
  return R"js(
'use strict';
(function () {
  const vocabulary = 'http://www.w3.org/2000/svg';
  const reading = document.createElement('div');
  reading.id = 'reading';
  reading.hidden = true;
  document.body.append(reading);

  const made = (parent, kind, attributes, text) => {
    const e = document.createElementNS(vocabulary, kind);
    for (const key in attributes) e.setAttribute(key, attributes[key]);
    if (text !== undefined) e.textContent = text;
    parent.append(e);
    return e;
  };
  const axis = text => {
    const [from, to, low, high, how] = text.split(' ');
    const a = {from: +from, to: +to, low: +low, high: +high, log: how === 'log10'};
    a.all = [a.low, a.high];
    a.pixel = x => a.from + (a.to - a.from) * (x - a.low) / (a.high - a.low);
    a.value = p => a.low + (a.high - a.low) * (p - a.from) / (a.to - a.from);
    a.told = x => { const v = a.log ? Math.pow(10, x) : x; return Number(v.toPrecision(5)).toString(); };
    return a;
  };
  // Ticks at 1, 2 or 5 times a power of ten, on an axis of logarithms at whole ones while there are two.
  const ticks = (a, count, whole) => {
    const rough = (a.high - a.low) / count, power = Math.pow(10, Math.floor(Math.log10(rough)));
    let step = [1, 2, 5, 10].map(f => f * power).find(s => s >= rough * (1 - 1e-9));
    if (whole || (a.log && a.high - a.low >= 2)) step = Math.max(1, Math.ceil(step));
    const list = [];
    for (let k = Math.ceil(a.low / step - 1e-9); k * step <= a.high + 1e-9 * step; ++k) {
      const x = k * step, v = Math.abs(x) < 1e-6 * step ? 0 : x, size = Math.max(Math.abs(a.low), Math.abs(a.high));
      const digits = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
      const places = v === 0 ? 0 : Math.max(0, Math.floor(Math.log10(Math.abs(v)) + 1e-9) - Math.floor(Math.log10(step) + 1e-9));
      list.push([x, a.log ? (step >= 1 ? '1e' + v : Math.pow(10, v).toPrecision(3))
                          : v === 0 ? '0' : size >= 1e-3 && size < 1e6 ? v.toFixed(digits) : v.toExponential(places)]);
    }
    return list;
  };

  document.querySelectorAll('svg[data-across]').forEach((svg, index) => {
    const x = axis(svg.dataset.across), y = axis(svg.dataset.up);
    const over = svg.querySelector('title').textContent;
    const abscissa = over.slice(over.lastIndexOf(' over ') + 6), timed = abscissa === 'time [s]';
    svg.querySelector('title').remove();  // it would hide the reading
    svg.setAttribute('aria-label', over);
    const group = svg.querySelector('g.curves'), grid = svg.querySelector('g.ticks');
    const curves = [];
    for (const e of group.children) {
      const dot = e.localName === 'circle';
      const points = dot ? [[+e.getAttribute('cx'), +e.getAttribute('cy')]]
                         : e.getAttribute('points').trim().split(' ').map(p => p.split(',').map(Number));
      curves.push({e, dot, name: e.dataset.name, points: points.map(([a, b]) => [x.value(a), y.value(b)])});
    }
    const clip = made(made(svg, 'defs', {}), 'clipPath', {id: 'room' + index});
    made(clip, 'rect', {x: x.from, y: y.to, width: x.to - x.from, height: y.from - y.to});
    group.setAttribute('clip-path', 'url(#room' + index + ')');
    const line = made(svg, 'line', {y1: y.from, y2: y.to, stroke: '#888888', visibility: 'hidden'});
    const now = made(svg, 'line', {y1: y.from, y2: y.to, stroke: '#a3195b', 'stroke-opacity': 0.6, visibility: 'hidden'});
    const span = made(svg, 'rect', {y: y.to, height: y.from - y.to, fill: '#14316e', 'fill-opacity': 0.12, visibility: 'hidden'});
    const show = (e, on) => e.setAttribute('visibility', on ? 'visible' : 'hidden');

    const redraw = () => {
      for (const c of curves)
        if (c.dot) {
          c.e.setAttribute('cx', x.pixel(c.points[0][0]).toFixed(2));
          c.e.setAttribute('cy', y.pixel(c.points[0][1]).toFixed(2));
        } else {
          c.e.setAttribute('points', c.points.map(p => x.pixel(p[0]).toFixed(2) + ',' + y.pixel(p[1]).toFixed(2)).join(' '));
        }
      for (const m of svg.querySelectorAll('path.mark')) {
        const at = x.log ? Math.log10(m.dataset.at) : +m.dataset.at;
        m.setAttribute('d', 'M' + x.pixel(at).toFixed(2) + ' ' + y.from + 'v-7');
        show(m, at >= x.low && at <= x.high);
      }
      grid.replaceChildren();
      const lines = {stroke: '#dddddd'};
      for (const [v, label] of ticks(x, Math.max(2, svg.viewBox.baseVal.width / 80), svg.dataset.counting)) {
        made(grid, 'line', {x1: x.pixel(v), x2: x.pixel(v), y1: y.from, y2: y.to, ...lines});
        made(grid, 'text', {x: x.pixel(v), y: y.from + 15, 'text-anchor': 'middle'}, label);
      }
      for (const [v, label] of ticks(y, Math.max(3, svg.viewBox.baseVal.height / 32))) {
        made(grid, 'line', {x1: x.from, x2: x.to, y1: y.pixel(v), y2: y.pixel(v), ...lines});
        made(grid, 'text', {x: x.from - 5, y: y.pixel(v) + 4, 'text-anchor': 'end'}, label);
      }
    };
    const zoom = (low, high) => {
      let least = Infinity, most = -Infinity;
      for (const c of curves)
        c.points.forEach((p, i) => {
          const near = [i - 1, i, i + 1].some(k => c.points[k] && c.points[k][0] >= low && c.points[k][0] <= high);
          if (near) { least = Math.min(least, p[1]); most = Math.max(most, p[1]); }
        });
      if (!(high - low > 1e-6 * (x.all[1] - x.all[0])) || !(most >= least)) return;
      const room = 0.04 * (most - least) || 0.02 * (y.all[1] - y.all[0]);
      [x.low, x.high, y.low, y.high] = [low, high, least - room, most + room];
      svg.dataset.zoomed = x.told(low) + ' ' + x.told(high);
      redraw();
    };

    const at = e => {
      const box = svg.getBoundingClientRect();
      return (e.clientX - box.left) * svg.viewBox.baseVal.width / box.width;
    };
    const inside = p => Math.min(x.to, Math.max(x.from, p));
    let pressed = null;
    svg.onpointerdown = e => { pressed = inside(at(e)); svg.setPointerCapture(e.pointerId); };
    svg.onpointermove = e => {
      const p = inside(at(e));
      line.setAttribute('x1', p);
      line.setAttribute('x2', p);
      show(line, true);
      if (pressed !== null) {
        span.setAttribute('x', Math.min(p, pressed));
        span.setAttribute('width', Math.abs(p - pressed));
        show(span, true);
      }
      const v = svg.dataset.counting ? Math.round(x.value(p)) : x.value(p), rows = [abscissa + ' ' + x.told(v)];
      for (const c of curves) {
        const i = c.dot ? -1 : c.points.findIndex(q => q[0] >= v - 1e-4 * (x.high - x.low));
        if (i < 0 || (i === 0 && c.points[0][0] > v + 1e-2 * (x.high - x.low))) continue;
        const b = c.points[i], a = c.points[Math.max(0, i - 1)];
        const f = b[0] > a[0] ? Math.min(1, (v - a[0]) / (b[0] - a[0])) : 1;
        rows.push((c.name || over.slice(0, over.lastIndexOf(' over '))) + ' ' + y.told(a[1] + f * (b[1] - a[1])));
      }
      reading.textContent = rows.join('\n');
      reading.style.left = Math.min(e.clientX + 14, innerWidth - 220) + 'px';
      reading.style.top = e.clientY + 14 + 'px';
      reading.hidden = false;
    };
    svg.onpointerup = e => {
      const from = pressed, to = inside(at(e));
      pressed = null;
      show(span, false);
      if (from === null) return;
      if (Math.abs(to - from) > 4) zoom(x.value(Math.min(from, to)), x.value(Math.max(from, to)));
      else if (timed) document.dispatchEvent(new CustomEvent('costate-seek', {detail: x.value(to)}));
    };
    svg.onpointerleave = () => { show(line, false); reading.hidden = true; };
    svg.ondblclick = () => {
      [x.low, x.high] = x.all;
      [y.low, y.high] = y.all;
      delete svg.dataset.zoomed;
      redraw();
    };
    if (timed) document.addEventListener('costate-time', e => {
      const p = x.pixel(e.detail);
      now.setAttribute('x1', p);
      now.setAttribute('x2', p);
      show(now, p >= x.from && p <= x.to);
    });
  });
})();
)js";
}

}  // namespace costate::app
