// Draws the figures of a report: in the reader's theme, those on the screen first.
"use strict";
(async () => {
  const decoded = (text) => Uint8Array.fromBase64?.(text) ?? Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const bytes = (id) => decoded(document.getElementById(id).textContent);
  const unpacked = (id) =>
    new Response(new Blob([bytes(id)]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  const [library, stated] = await Promise.all([unpacked("library"), unpacked("figures")]);
  const script = document.createElement("script");
  script.textContent = library;
  document.head.append(script);

  const figures = JSON.parse(stated);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const phone = matchMedia("(max-width: 680px)");
  const pointer = matchMedia("(hover: hover)"); // without one, buttons would always cover something
  const drawn = []; // of each plot: what it shows, and where
  const ranges = {}; // to which plots are zoomed together: those of a run's time, those of a figure
  let linking = false;

  const isObject = (value) => value !== null && typeof value === "object" && !ArrayBuffer.isView(value);

  // Arrays as numbers, once: {dtype, bdata} -> typed array.
  const numbers = (value) => {
    if (!isObject(value)) return value;
    if (value.bdata !== undefined) {
      const { buffer } = decoded(value.bdata);
      return value.dtype === "i4" ? new Int32Array(buffer) : new Float32Array(buffer);
    }
    for (const key of Object.keys(value)) value[key] = numbers(value[key]);
    return value;
  };

  const colour = (role) => {
    const [, name, opacity] = role.split(":");
    const shade = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    if (opacity === undefined) return shade;
    const [r, g, b] = [1, 3, 5].map((i) => parseInt(shade.slice(i, i + 2), 16));
    return `rgba(${r},${g},${b},${opacity})`;
  };

  // A copy in the colours of the theme; plotly.js writes into what it is given.
  const themed = (value) => {
    if (typeof value === "string") return value.startsWith("role:") ? colour(value) : value;
    if (Array.isArray(value)) return value.map(themed);
    if (!isObject(value)) return value;
    return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, themed(each)]));
  };

  const BARS = 90; // [px] above and below a space: its legend and its colour bar

  const barOf = (label) => ({
    orientation: "h", thickness: 12, len: 0.82, x: 0.5, xanchor: "center", y: -0.02, yanchor: "top",
    title: { text: label, side: "bottom" }, outlinewidth: 0, ticks: "outside",
  });

  // Above the panel, where the names of its columns below need room.
  const aboveOf = (label) => ({ ...barOf(label), y: 1.02, yanchor: "bottom", title: { text: label, side: "top" } });

  // The triangles of a mesh of which all corners are known, or the others.
  const known = (mesh, values, wanted) => {
    const kept = { i: [], j: [], k: [] };
    for (let n = 0; n < mesh.i.length; n++) {
      const [a, b, c] = [mesh.i[n], mesh.j[n], mesh.k[n]];
      if (Number.isFinite(values[a] + values[b] + values[c]) === wanted) {
        kept.i.push(a); kept.j.push(b); kept.k.push(c);
      }
    }
    return kept;
  };

  const coloured = (trace, chosen, bar) => {
    const scale = { cmin: chosen.low, cmax: chosen.high, colorscale: chosen.scale, colorbar: barOf(chosen.label), showscale: bar };
    const said = Array.from(chosen.values, (value) => `${chosen.quantity} ${value.toPrecision(4)} ${chosen.unit}`);
    const shown = { ...trace, hovertext: said, hovertemplate: [trace.hovertemplate, "%{hovertext}"].filter(Boolean).join("<br>") };
    delete shown.hoverinfo;
    if (trace.type !== "mesh3d") {
      const part = trace.mode === "lines" ? "line" : "marker";
      return [{ ...shown, [part]: { ...trace[part], ...scale, color: chosen.values } }];
    }
    const { unknown, ...mesh } = shown;
    const some = known(mesh, chosen.values, true);
    Object.assign(mesh, scale, { intensity: chosen.values, legendgroup: mesh.uid });
    delete mesh.color;
    if (some.i.length === trace.i.length) return [mesh];
    const rest = { ...trace, ...known(trace, chosen.values, false), uid: `${trace.uid} unknown`, legendgroup: trace.uid };
    return [{ ...mesh, ...some }, plain({ ...rest, showlegend: false, hoverinfo: "skip", hovertemplate: null })];
  };

  // A rigid body where it is in a step.
  const placed = (mesh, extra, step) => {
    const place = extra.places.subarray(3 * step, 3 * step + 3);
    const turn = extra.turns.subarray(9 * step, 9 * step + 9);
    const row = (i) => mesh.x.map((x, n) =>
      turn[3 * i] * x + turn[3 * i + 1] * mesh.y[n] + turn[3 * i + 2] * mesh.z[n] + place[i]);
    return { x: row(0), y: row(1), z: row(2) };
  };

  // A mesh that once had values keeps them in plotly.js, so that what is unknown has one value of one colour.
  const plain = ({ unknown, ...trace }) =>
    unknown
      ? { ...trace, intensity: new Float32Array(trace.x.length), colorscale: [[0, unknown], [1, unknown]], showscale: false }
      : trace;

  const quantities = (plot) => [...new Set(plot.extras.flatMap((each) => (each.colourings ?? []).map((c) => c.quantity)))];

  // What has the chosen quantity is coloured by it, all else of the plot is plain; plots without it keep their first.
  const traces = (plot, state) => {
    const names = quantities(plot);
    const quantity = names.includes(state.colouring) ? state.colouring : names[0];
    let bar = true; // one is enough
    return plot.data.flatMap((stated, n) => {
      const extra = plot.extras[n];
      const trace = themed(stated);
      if (extra.step !== undefined && extra.step !== state.step) return [];
      trace.uid = extra.step !== undefined && trace.name ? trace.name : `${n}`;
      if (extra.moving) {
        trace.x = [extra.moving.x[state.step]];
        trace.y = [extra.moving.y[state.step]];
      }
      if (extra.places) Object.assign(trace, placed(trace, extra, state.step));
      if (extra.meshes) Object.assign(trace, extra.meshes[state.step]);
      if (trace.marker?.colorbar) trace.marker.colorbar = { ...barOf(trace.marker.colorbar.title.text), y: -0.2 };
      if (trace.type === "heatmap" && trace.colorbar) trace.colorbar = aboveOf(trace.colorbar.title.text);
      const chosen = (extra.colourings ?? []).find((each) => each.quantity === quantity);
      if (!chosen) return [plain(trace)];
      const first = bar && trace.visible !== "legendonly";
      bar = bar && !first;
      return coloured(trace, chosen, first);
    });
  };

  const axis = (stated, base) => ({
    gridcolor: base.grid, linecolor: base.quiet, tickcolor: base.quiet, zeroline: false, showline: true,
    ticks: "outside", ticklen: 4, automargin: true, ...stated, title: { ...stated.title, standoff: 8 },
  });

  const layout = (plot) => {
    const base = { ink: colour("role:ink"), quiet: colour("role:quiet"), grid: colour("role:line") };
    const { title, xaxis, yaxis, scene, ...rest } = themed(plot.layout);
    const whole = {
      ...rest, autosize: true, uirevision: "kept", paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: rest.plot_bgcolor ?? "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 12, color: base.ink },
      margin: { l: plot.kind === "flat" ? 64 : 0, r: 10, t: title ? 26 : 10, b: plot.kind === "flat" ? 44 : 0 },
      hoverlabel: { bgcolor: colour("role:card"), bordercolor: base.quiet, font: { color: base.ink } },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: base.quiet, activecolor: base.ink },
      hovermode: plot.zoomedWith === "run" ? "x unified" : "closest",
      legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom", xanchor: "left", tracegroupgap: 0, font: { size: 12 } },
    };
    if (title) whole.title = { text: title, x: 0, xanchor: "left", y: 1, yanchor: "top", pad: { t: 4 }, font: { size: 13 } };
    if (plot.kind === "flat") {
      whole.xaxis = axis(xaxis, base);
      whole.yaxis = axis(yaxis, base);
      if (plot.zoomedWith) whole.yaxis.automargin = false; // they stand below one another
      if (ranges[plot.zoomedWith]) Object.assign(whole.xaxis, { range: ranges[plot.zoomedWith], autorange: false });
    } else {
      whole.scene = scene;
      for (const name of ["xaxis", "yaxis", "zaxis"])
        Object.assign(scene[name], { gridcolor: base.grid, color: base.ink, zerolinecolor: base.grid, showspikes: false });
      whole.margin.b = 56;
    }
    return whole;
  };

  const buttons = {
    flat: ["toImage", "zoom2d", "pan2d", "autoScale2d"],
    space: ["toImage", "orbitRotation", "pan3d", "zoom3d", "resetCameraDefault3d"],
  };
  const settings = (plot) => ({
    displaylogo: false, displayModeBar: pointer.matches ? "hover" : false, responsive: true, modeBarButtons: [buttons[plot.kind]],
    toImageButtonOptions: { format: plot.kind === "flat" ? "svg" : "png", scale: 2 },
  });

  const show = (each) => {
    const stated = layout(each.plot);
    if (each.plot.kind === "space") {
      // plotly.js fits a space to the height of its panel: on a phone it is not to be higher than wide
      stated.height = Math.min(stated.height, 0.8 * each.div.clientWidth + BARS);
      each.div.style.height = `${stated.height}px`;
    }
    return Plotly.react(each.div, traces(each.plot, each.state), stated, settings(each.plot));
  };

  // Another step: where rings alone move, nothing else is drawn again.
  const move = (each) => {
    const { kind, extras } = each.plot;
    if (kind !== "flat" || extras.some((extra) => extra.step !== undefined)) return show(each);
    const rings = [...extras.keys()].filter((n) => extras[n].moving);
    const at = ({ moving }) => ({ x: [moving.x[each.state.step]], y: [moving.y[each.state.step]] });
    const now = { mode: "immediate", frame: { duration: 0, redraw: false }, transition: { duration: 0 } };
    if (!rings.length) return;
    // it is rejected where the next step comes first
    Plotly.animate(each.div, { data: rings.map((n) => at(extras[n])), traces: rings }, now).catch(() => {});
  };

  const link = (from) => (change) => {
    if (linking) return;
    const together = from.plot.zoomedWith;
    if (change["xaxis.autorange"]) delete ranges[together];
    else if (change["xaxis.range[0]"] !== undefined) ranges[together] = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    else return;
    linking = true;
    const wanted = ranges[together] ? { "xaxis.range": ranges[together] } : { "xaxis.autorange": true };
    const others = drawn.filter((each) => each !== from && each.plot.zoomedWith === together);
    Promise.all(others.map((each) => Plotly.relayout(each.div, wanted))).finally(() => { linking = false; });
  };

  const switchOf = (figure, state, plots) => {
    const choices = plots.map((each) => quantities(each.plot)).filter((names) => names.length > 1);
    if (!choices.length) return;
    const names = [...new Set(choices.flat())];
    const select = document.createElement("select");
    select.setAttribute("aria-label", "coloured by");
    for (const name of names) select.add(new Option(name, name));
    select.onchange = () => { state.colouring = select.value; plots.forEach(show); };
    const label = document.createElement("label");
    label.append("coloured by ", select);
    figure.querySelector(".controls").append(label);
  };

  const playerOf = (figure, state, plots, names) => {
    if (!names.length) return;
    const [play, slider, said] = ["button", "input", "output"].map((tag) => document.createElement(tag));
    Object.assign(slider, { type: "range", min: 0, max: names.length - 1, value: state.step });
    slider.setAttribute("aria-label", "step");
    let timer = null;
    const go = (step) => { state.step = step; slider.value = step; said.textContent = names[step]; plots.forEach(move); };
    const stop = () => { clearInterval(timer); timer = null; play.textContent = "\u25b6 play"; };
    slider.oninput = () => { stop(); go(Number(slider.value)); };
    play.onclick = () => {
      if (timer) return stop();
      play.textContent = "\u25a0 stop";
      if (state.step === names.length - 1) state.step = -1;
      timer = setInterval(() => (state.step + 1 < names.length ? go(state.step + 1) : stop()), Math.max(50, 6000 / names.length));
    };
    said.textContent = names[state.step];
    play.textContent = "\u25b6 play";
    figure.querySelector(".controls").append(play, slider, said);
  };

  const draw = async (figure) => {
    if (figure.dataset.drawn) return;
    figure.dataset.drawn = "begun";
    const stated = figures[Number(figure.dataset.figure)];
    const state = { step: stated.step, colouring: null };
    const divs = [...figure.querySelectorAll(".plot")];
    const plots = stated.plots.map((plot, n) => ({ plot: numbers(plot), div: divs[n], state }));
    for (const { plot } of plots) if (plot.zoomedWith === "figure") plot.zoomedWith += figure.dataset.figure;
    for (const each of plots) {
      await show(each);
      drawn.push(each);
      if (each.plot.zoomedWith) each.div.on("plotly_relayout", link(each));
    }
    switchOf(figure, state, plots);
    playerOf(figure, state, plots, stated.steps);
    figure.dataset.drawn = "done";
  };

  const again = () => drawn.forEach(show);
  dark.addEventListener("change", again);
  phone.addEventListener("change", again);
  const all = [...document.querySelectorAll("[data-figure]")];
  const onScreen = (figure) => figure.getBoundingClientRect().top < innerHeight;
  for (const figure of all.filter(onScreen)) await draw(figure);
  document.body.dataset.shown = "first";
  const idle = () => new Promise((resolve) => (window.requestIdleCallback ?? setTimeout)(resolve));
  for (const figure of all) { await idle(); await draw(figure); }
  document.body.dataset.shown = "all";
})().catch((why) => {
  for (const each of document.querySelectorAll(".plots")) each.textContent = `This browser cannot draw it: ${why}`;
});
