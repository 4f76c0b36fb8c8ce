#include "plot_script.h"

namespace costate::app {

const char* plot_style() {
  return ".plot { position: relative; max-width: 100%; } .plot canvas { cursor: crosshair; touch-action: pan-y; }\n"
         ".plot div { position: absolute; pointer-events: none; background: #14316e1f; }\n"
         ".plot div.now { width: 1px; background: #a3195b99; }\n"
         "@media screen { .plots svg.read { display: none; } }\n@media print { .plot { display: none; } }\n";
}

const char* plot_script() {
  return R"js(
'use strict';
(function () {
  const shown = v => v === 0 ? '0' : Number(v.toPrecision(5)).toString();
  // With the digits that the thousandths of a pixel bear.
  const told = (a, v) => a.log ? Number(v.toPrecision(4)).toString() : Number((Math.round(v / a.unit) * a.unit).toPrecision(6)).toString();
  const axis = text => {
    const [from, to, low, high, how] = text.split(' '), log = how === 'log10';
    const of = t => log ? Math.pow(10, t) : t;
    return {from: +from, to: +to, log, low: of(+low), high: of(+high), scaled: v => log ? Math.log10(v) : v, of,
            value: p => of(+low + (high - low) * (p - from) / (to - from)), unit: Math.pow(10, Math.ceil(Math.log10(high - low) - 5))};
  };

  // What is under the pointer: of a line the point beside it (the nearest, of one that turns back), a dot that it is on.
  Chart.Interaction.modes.curves = (chart, event) => {
    const found = [], p = Chart.helpers.getRelativePosition(event, chart);
    for (const meta of chart.getSortedVisibleDatasetMetas()) {
      const set = chart.data.datasets[meta.index];
      let best = -1, least = set.showLine ? Infinity : 8;
      meta.data.forEach((e, i) => {
        const far = set.sorted ? Math.abs(e.x - p.x) : Math.hypot(e.x - p.x, e.y - p.y);
        if (far < least && e.x >= chart.chartArea.left - 1 && e.x <= chart.chartArea.right + 1) [best, least] = [i, far];
      });
      const ends = [meta.data[0], meta.data[meta.data.length - 1]].map(e => e.x);
      const beside = set.sorted && (p.x < ends[0] - 8 || p.x > ends[1] + 8);  // of a line that is interrupted
      if (best >= 0 && !beside) found.push({element: meta.data[best], datasetIndex: meta.index, index: best});
    }
    return found;
  };

  const sets = (svg, x, y) => {
    const all = [];
    for (const e of svg.querySelector('g.curves').children) {
      const value = a => e.getAttribute(a), last = all[all.length - 1], order = -all.length;  // later ones above
      if (e.localName === 'polyline') {
        const data = value('points').trim().split(' ').map(p => p.split(',')).map(p => ({x: x.value(p[0]), y: y.value(p[1])}));
        const sorted = data.every((p, i) => i === 0 || p.x >= data[i - 1].x);
        const dashes = value('stroke-dasharray');
        all.push({label: e.dataset.name, data, sorted, order, showLine: true, pointRadius: 0, borderColor: value('stroke'),
                  backgroundColor: value('stroke'), borderWidth: +value('stroke-width'),
                  borderDash: dashes ? dashes.split(' ').map(Number) : []});
      } else if (e.dataset.markers) {  // of the points of the line before it
        last.pointRadius = +value('r');
      } else {
        const name = e.querySelector('title'), color = value('fill'), label = e.dataset.name;
        const dot = {x: x.value(value('cx')), y: y.value(value('cy')), name: name ? name.textContent : ''};
        if (last && !last.showLine && last.label === label && last.backgroundColor === color) last.data.push(dot);
        else all.push({label, data: [dot], order, showLine: false, pointRadius: +value('r'), backgroundColor: color, borderColor: color});
      }
    }
    return all;
  };

  document.querySelectorAll('svg[data-across]').forEach(svg => {
    const x = axis(svg.dataset.across), y = axis(svg.dataset.up), size = svg.viewBox.baseVal;
    const over = svg.querySelector('title').textContent, at = over.lastIndexOf(' over ');
    const abscissa = over.slice(at + 6), ordinate = over.slice(0, at), timed = abscissa === 'time [s]';
    const marks = Array.from(svg.querySelectorAll('path.mark'), m => +m.dataset.at);
    const made = (parent, kind, name) => {
      const e = document.createElement(kind);
      e.className = name;
      parent.append(e);
      return e;
    };
    const box = document.createElement('div');
    box.className = 'plot';
    const datasets = sets(svg, x, y), names = datasets.filter(d => d.label), beside = x.to < size.width - 13;
    const height = size.height + (names.length > 0 && !beside ? 18 : 0);  // the names have a line of their own
    box.style.cssText = 'width:' + size.width + 'px;aspect-ratio:' + size.width + '/' + height;
    svg.after(box);
    svg.classList.add('read');
    const canvas = made(box, 'canvas', ''), span = made(box, 'div', 'span'), now = made(box, 'div', 'now');
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', over);

    const scale = (a, text, counting) => ({
      type: a.log ? 'logarithmic' : 'linear', min: a.low, max: a.high,
      title: {display: text !== '', text}, grid: {color: '#dddddd', borderColor: '#888888'},
      ticks: {precision: counting ? 0 : undefined, includeBounds: false, maxRotation: 0, autoSkipPadding: 12,
              callback: v => Math.abs(v) >= 1e6 || (v !== 0 && Math.abs(v) < 1e-4) ? Number(v.toPrecision(6)).toExponential() : shown(v)},
      afterBuildTicks: s => {  // over decades, whole ones
        const whole = s.ticks.filter(t => Math.abs(Math.log10(t.value) - Math.round(Math.log10(t.value))) < 1e-9);
        if (a.log && whole.length > 2) s.ticks = whole;
      }});
    const named = (item, data) => item.text && data.datasets.findIndex(d => d.label === item.text) === item.datasetIndex;
    const chart = new Chart(canvas, {
      type: 'scatter',
      data: {datasets},
      options: {
        animation: false, maintainAspectRatio: false, parsing: false, normalized: true, locale: 'en',
        interaction: {mode: 'curves', intersect: false},
        elements: {line: {tension: 0}, point: {hoverRadius: 4, hitRadius: 0, borderWidth: 0}},
        scales: {x: scale(x, abscissa, svg.dataset.counting), y: scale(y, '', false)},
        plugins: {
          title: {display: true, text: ordinate, align: 'start', font: {weight: 'normal'}, padding: {top: 2, bottom: 2}, color: '#222222'},
          legend: {
            display: names.length > 0, reverse: true, align: 'end', position: beside ? 'right' : 'top',
            labels: {filter: named, boxWidth: 22, boxHeight: 0, padding: 6},
            onClick: (event, item) => {  // a line that is interrupted is several
              const on = !chart.isDatasetVisible(item.datasetIndex);
              datasets.forEach((d, i) => { if (d.label === item.text) chart.setDatasetVisibility(i, on); });
              chart.update('none');
            }},
          tooltip: {
            animation: false,
            callbacks: {
              title: items => items.length > 0 ? abscissa + ' ' + told(x, items[0].parsed.x) : '',
              label: item => {
                const first = item.chart.tooltip.dataPoints[0].parsed.x, there = item.parsed.x;
                return (item.raw.name || item.dataset.label || ordinate) + ' ' + told(y, item.parsed.y) +
                       (told(x, there) === told(x, first) ? '' : ' at ' + told(x, there));
              }}}}},
      plugins: [{
        id: 'events',
        afterDatasetsDraw: c => {
          for (const t of marks.filter(t => t >= c.scales.x.min && t <= c.scales.x.max)) {
            c.ctx.fillStyle = '#a3195b';
            c.ctx.fillRect(c.scales.x.getPixelForValue(t) - 0.5, c.chartArea.bottom - 7, 1, 7);
          }
        }}]});

    const show = (low, high, least, most) => {
      [[chart.options.scales.x, low, high], [chart.options.scales.y, least, most]].forEach(([s, a, b]) => { [s.min, s.max] = [a, b]; });
      chart.update('none');
    };
    const zoom = (low, high) => {  // with the ordinates that are seen then, those of a line between its points, too
      const seen = [], inside = v => v >= low && v <= high, [a, b] = [low, high].map(x.scaled);
      datasets.forEach((d, k) => chart.isDatasetVisible(k) && d.data.forEach((p, i) => {
        if (inside(p.x)) seen.push(y.scaled(p.y));
        const q = d.data[i + 1];
        if (!d.showLine || !q) return;
        const from = x.scaled(p.x), to = x.scaled(q.x);
        for (const c of [a, b])
          if ((from - c) * (to - c) < 0) seen.push(y.scaled(p.y) + (y.scaled(q.y) - y.scaled(p.y)) * (c - from) / (to - from));
      }));
      if (seen.length === 0 || !(b - a > 1e-6 * (x.scaled(x.high) - x.scaled(x.low)))) return;
      let [least, most] = [Infinity, -Infinity];
      for (const v of seen) [least, most] = [Math.min(least, v), Math.max(most, v)];
      const room = 0.04 * (most - least) || 0.02 * (y.scaled(y.high) - y.scaled(y.low));
      show(low, high, y.of(least - room), y.of(most + room));
      box.dataset.zoomed = shown(low) + ' ' + shown(high);
    };

    const inside = p => Math.min(chart.chartArea.right, Math.max(chart.chartArea.left, p));
    const lay = (e, from, width) => {
      const area = chart.chartArea;
      e.style.cssText = 'left:' + from + 'px;top:' + area.top + 'px;height:' + (area.bottom - area.top) + 'px;' +
                        (width === undefined ? '' : 'width:' + width + 'px');
    };
    const value = p => chart.scales.x.getValueForPixel(p);
    let pressed = null, moment = null;
    const mark = () => {
      const p = moment === null ? NaN : chart.scales.x.getPixelForValue(moment);
      now.hidden = !(p >= chart.chartArea.left - 0.5 && p <= chart.chartArea.right + 0.5);
      if (!now.hidden) lay(now, p);
    };
    span.hidden = now.hidden = true;
    canvas.onpointerdown = e => {
      if (e.button !== 0 || e.offsetY < chart.chartArea.top || e.offsetY > chart.chartArea.bottom) return;
      pressed = inside(e.offsetX);
      canvas.setPointerCapture(e.pointerId);
    };
    canvas.onpointermove = e => {
      const p = inside(e.offsetX);
      span.hidden = pressed === null;
      if (!span.hidden) lay(span, Math.min(p, pressed), Math.abs(p - pressed));
    };
    canvas.onpointerup = e => {
      const from = pressed, to = inside(e.offsetX);
      pressed = null;
      span.hidden = true;
      if (from === null) return;
      if (Math.abs(to - from) > 4) zoom(value(Math.min(from, to)), value(Math.max(from, to)));
      else if (timed) document.dispatchEvent(new CustomEvent('costate-seek', {detail: value(to)}));
      mark();
    };
    canvas.onpointercancel = () => { pressed = null; span.hidden = true; };
    canvas.ondblclick = () => {
      delete box.dataset.zoomed;
      show(x.low, x.high, y.low, y.high);
      mark();
    };
    if (timed) document.addEventListener('costate-time', e => { moment = e.detail; mark(); });
  });
})();
)js";
}

}  // namespace costate::app
