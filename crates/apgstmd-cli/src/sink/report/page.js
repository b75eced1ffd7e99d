"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const { frames, thumbnails, tracks, bins, width, height } = data;
  const count = frames.frame.length;
  // Told apart by colour-blind eyes as well, bright upon pictures: those of --overlay and --video.
  const COLOURS = ["#ffb020", "#56c4ff", "#fff050", "#ff78be", "#46e1a0", "#ff8040"];
  const TRAIL = 48, NEAR = 8, LISTED = 8, TABLE = 50;
  // Far weaker than the best: drawn like what belongs to no track.
  const least = data.weak * Math.max(0, ...tracks.map((track) => track.best));
  const strong = tracks.filter((track) => track.best >= least);
  const colour = (track) => COLOURS[track % COLOURS.length];
  const slider = $("slider"), image = $("image"), marks = $("marks"), viewer = $("viewer");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  let index = 0, playing = false;

  /** Place of the last entry that is not above `value`, -1 where all are. */
  const below = (list, value) => {
    let low = 0, high = list.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (list[middle] <= value) low = middle + 1; else high = middle;
    }
    return low - 1;
  };
  const nearest = (list, value) => {
    const at = below(list, value);
    if (at < 0) return 0;
    return at + 1 < list.length && list[at + 1] - value < value - list[at] ? at + 1 : at;
  };
  const number = (value, digits = 3) => {
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e5 || size < 1e-3) return value.toExponential(digits - 1);
    return String(Number(value.toPrecision(digits)));
  };
  const plural = (n, thing) => `${n.toLocaleString("en")} ${thing}${n === 1 ? "" : "s"}`;
  const element = (name, text, attributes = {}) => {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };
  const shape = (name, attributes) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };

  /** Where a track is in a frame; between points that are kept, on the line. */
  const place = (track, frame) => {
    const at = below(track.frame, frame);
    if (at < 0 || frame > track.frame[track.frame.length - 1]) return null;
    const next = Math.min(at + 1, track.frame.length - 1);
    const span = track.frame[next] - track.frame[at];
    const part = span > 0 ? (frame - track.frame[at]) / span : 0;
    return { x: track.x[at] + part * (track.x[next] - track.x[at]), y: track.y[at] + part * (track.y[next] - track.y[at]) };
  };

  /** Detections of a position of the slider, each with its track where it has one, and tracks that nothing was found for. */
  const found = (position) => {
    const frame = frames.frame[position];
    const spots = [];
    for (let k = frames.from[position]; k < frames.from[position + 1]; k++) {
      spots.push({ x: frames.x[k], y: frames.y[k], score: frames.score[k], direction: frames.direction[k], track: null });
    }
    const coasting = [];
    for (const track of strong) {
      const at = place(track, frame);
      if (!at) continue;
      let best = null, least = NEAR;
      for (const spot of spots) {
        const distance = Math.hypot(spot.x - at.x, spot.y - at.y);
        if (spot.track === null && distance < least) { best = spot; least = distance; }
      }
      if (best) best.track = track; else coasting.push({ ...at, track });
    }
    return { spots, coasting };
  };

  const RADIUS = Math.max(8, 0.013 * Math.max(width, height));
  const ring = (x, y, stroke, more = {}) => shape("circle", {
    cx: x + 0.5, cy: y + 0.5, r: RADIUS, fill: "none", stroke, "stroke-width": 2, "vector-effect": "non-scaling-stroke", ...more,
  });
  // The border of the region, where there is one: under everything else, and not inside rings.
  const border = (data.outline ?? []).map(([x, y, u, v]) => `M${x} ${y}L${u} ${v}`).join("");
  const strokes = border ? [["#000", 2.5, 0.3], ["#fff", 1, 0.75]].map(([stroke, wide, opacity]) => shape("path", {
    d: border, fill: "none", stroke, "stroke-width": wide, "stroke-opacity": opacity, "vector-effect": "non-scaling-stroke", mask: "url(#free)",
  })) : [];
  const free = (spots) => {
    const all = { x: 0, y: 0, width, height };
    const mask = shape("mask", { id: "free", maskUnits: "userSpaceOnUse", ...all });
    mask.append(shape("rect", { ...all, fill: "#fff" }), ...spots.map(({ x, y }) => shape("circle", { cx: x + 0.5, cy: y + 0.5, r: RADIUS, fill: "#000" })));
    return mask;
  };
  const draw = ({ spots, coasting }, frame) => {
    const drawn = border ? [free([...spots, ...coasting]), ...strokes] : [];
    if ($("trails").checked) {
      for (const track of strong) {
        const end = below(track.frame, frame);
        if (end < 0 || track.frame[track.frame.length - 1] < frame) continue;
        const points = [];
        for (let k = end; k >= 0 && track.frame[k] >= frame - TRAIL; k--) points.push(`${track.x[k] + 0.5},${track.y[k] + 0.5}`);
        if (points.length > 1) {
          drawn.push(shape("polyline", {
            points: points.join(" "), fill: "none", stroke: colour(track.track), "stroke-width": 1.5, "stroke-opacity": 0.7,
            "vector-effect": "non-scaling-stroke",
          }));
        }
      }
    }
    for (const spot of spots) {
      if (spot.track) {
        const stroke = colour(spot.track.track);
        drawn.push(ring(spot.x, spot.y, "#000", { "stroke-width": 4, "stroke-opacity": 0.4 }), ring(spot.x, spot.y, stroke));
        if (spot.direction !== null) {
          const [dx, dy] = [Math.cos(spot.direction), -Math.sin(spot.direction)];
          const along = (far) => ({ x: spot.x + 0.5 + far * dx, y: spot.y + 0.5 + far * dy });
          const [from, to] = [along(RADIUS), along(1.7 * RADIUS)];
          drawn.push(shape("line", {
            x1: from.x, y1: from.y, x2: to.x, y2: to.y, stroke, "stroke-width": 3, "vector-effect": "non-scaling-stroke",
          }));
        }
      } else if ($("faint").checked) {
        drawn.push(ring(spot.x, spot.y, "#fff", { "stroke-width": 1, "stroke-opacity": 0.55 }));
      }
    }
    for (const { x, y, track } of coasting) drawn.push(ring(x, y, colour(track.track), { "stroke-dasharray": "3 4" }));
    marks.replaceChildren(...drawn);
  };

  const ARROWS = ["\u2192", "\u2197", "\u2191", "\u2196", "\u2190", "\u2199", "\u2193", "\u2198"];
  const arrow = (direction) => direction === null ? "" : ARROWS[(Math.round(direction / (Math.PI / 4)) + 8) % 8];
  const list = (spots) => {
    const shown = [...spots].sort((a, b) => (b.track !== null) - (a.track !== null) || b.score - a.score).slice(0, LISTED);
    $("list-caption").textContent = shown.length < spots.length ? `${shown.length} of ${plural(spots.length, "detection")}`
      : plural(spots.length, "detection");
    $("list").replaceChildren(...shown.map((spot) => {
      const row = element("tr");
      const name = element("td", spot.track ? String(spot.track.track) : "\u2013");
      if (spot.track) name.prepend(dot(spot.track.track));
      row.append(name, ...[number(spot.score), spot.x.toFixed(1), spot.y.toFixed(1), arrow(spot.direction)].map((t) => element("td", t)));
      return row;
    }));
  };
  const dot = (track) => {
    const made = element("span", undefined, { class: "dot" });
    made.style.background = colour(track);
    return made;
  };

  /** How the background moved from the frame before to this one, which the camera's motion is. */
  const moved = (position) => {
    const camera = frames.camera;
    // Before the first there is nothing to compare with.
    if (!camera || position === 0) return "";
    if (camera.cut[position]) return "the scene is cut before this frame";
    if (camera.unexplained[position]) return "the picture does not tell how the camera moved";
    const [x, y, degrees, zoom] = ["x", "y", "degrees", "zoom"].map((name) => camera[name][position]);
    const far = Math.hypot(x, y);
    const parts = [far < 0.005 ? "background stands still" : `background moved ${far.toFixed(2)} px ${arrow(Math.atan2(-y, x))} (${x.toFixed(2)}, ${y.toFixed(2)})`];
    if (Math.abs(degrees) >= 0.005) parts.push(`turned ${Math.abs(degrees).toFixed(2)}\u00b0 ${degrees > 0 ? "counter-clockwise" : "clockwise"}`);
    if (Math.abs(zoom - 1) >= 5e-5) parts.push(`${zoom > 1 ? "grew" : "shrank"} by ${(100 * Math.abs(zoom - 1)).toFixed(2)} %`);
    return `${parts.join(", ")}; residual ${camera.residual[position].toFixed(4)}`;
  };
  const when = (position) => frames.time ? `${frames.time[position].toFixed(2)} s` : "";
  const show = (position) => {
    index = Math.max(0, Math.min(count - 1, position));
    const frame = frames.frame[index];
    const seen = found(index);
    const at = nearest(thumbnails.frame, frame);
    if (image.dataset.at !== String(at)) {
      image.dataset.at = String(at);
      image.src = thumbnails.image[at];
    }
    const off = frame - thumbnails.frame[at];
    const targets = seen.spots.filter((spot) => spot.track).length;
    const parts = [element("b", `Frame ${frame}`)];
    if (when(index)) parts.push(element("span", when(index)));
    parts.push(element("span", frames.name[index]), element("span", `${plural(targets, "target")}, ${plural(seen.spots.length, "detection")}`));
    if (off !== 0) {
      parts.push(element("span", `picture of frame ${thumbnails.frame[at]}, ${plural(Math.abs(off), "frame")} ${off > 0 ? "earlier" : "later"}`));
    }
    if (moved(index)) parts.push(element("span", `Camera: ${moved(index)}`, { class: "moved" }));
    $("caption").replaceChildren(...parts);
    image.alt = `Frame ${thumbnails.frame[at]} of ${data.title}`;
    draw(seen, frame);
    list(seen.spots);
    magnify(thumbnails.piece[at], off === 0);
    slider.value = String(index);
    slider.setAttribute("aria-valuetext", `frame ${frame}${when(index) && `, ${when(index)}`}, ${plural(targets, "target")}${moved(index) && `, ${moved(index)}`}`);
    $("cursor").style.left = `${100 * share(frame)}%`;
  };
  const magnify = (piece, here) => {
    const shown = $("magnified");
    shown.hidden = !piece || !here;
    if (!shown.hidden) shown.src = piece.image;
    $("piece-caption").textContent = !here ? "No picture of this very frame" : piece ? `Strongest, ${piece.side} px wide` : "Nothing found";
  };

  // Charts.
  const painters = [];
  const chart = (canvas, paint) => {
    const again = () => {
      const [w, h, dense] = [canvas.clientWidth, canvas.clientHeight, devicePixelRatio || 1];
      if (!w || !h) return;
      canvas.width = Math.round(w * dense);
      canvas.height = Math.round(h * dense);
      const pen = canvas.getContext("2d");
      pen.scale(dense, dense);
      pen.font = "12px system-ui, sans-serif";
      const style = getComputedStyle(document.documentElement);
      paint(pen, w, h, (name) => style.getPropertyValue(`--${name}`).trim());
    };
    new ResizeObserver(again).observe(canvas);
    painters.push(again);
  };
  dark.addEventListener("change", () => painters.forEach((paint) => paint()));

  const first = bins.first[0] ?? 0, end = (bins.last[bins.last.length - 1] ?? 0) + 1;
  const share = (frame) => (frame + 0.5 - first) / (end - first);
  const most = Math.max(1, ...bins.detections);
  const bar = (k, w) => {
    // Whole pixels: between two halves of one the ground would shine through.
    const [from, to] = [bins.first[k], bins.last[k] + 1].map((frame) => Math.round(w * (frame - first) / (end - first)));
    return [from, Math.max(to - from - (to - from > 4 ? 1 : 0), 1)];
  };
  chart($("timeline"), (pen, w, h, ink) => {
    const LANE = 56, GAP = 8;
    const best = Math.max(...bins.best, 1e-30);
    pen.fillStyle = ink("panel");
    pen.fillRect(0, 0, w, LANE);
    pen.fillRect(0, LANE + GAP, w, h - LANE - GAP);
    bins.first.forEach((_, k) => {
      const [x, wide] = bar(k, w);
      for (const [values, name] of [[bins.detections, "other"], [bins.tracked, "accent"]]) {
        const tall = Math.min(1, values[k] / most) * LANE;
        pen.fillStyle = ink(name);
        pen.fillRect(x, LANE - tall, wide, tall);
      }
      // Scores span decades: three of them are shown.
      const level = bins.best[k] > 0 ? Math.max(0, 1 + Math.log10(bins.best[k] / best) / 3) : 0;
      pen.fillStyle = ink("mark");
      pen.fillRect(x, h - Math.max(level * (h - LANE - GAP), bins.best[k] > 0 ? 1 : 0), wide, level * (h - LANE - GAP));
    });
  });
  const camera = bins.camera;
  const farthest = camera ? Math.max(...camera.shift) : 0;
  if (camera) {
    chart($("camera"), (pen, w, h, ink) => {
      const LANE = 40, GAP = 8;
      // What is below a hundredth of luminance is noise.
      const largest = Math.max(...camera.residual, 0.01);
      pen.fillStyle = ink("panel");
      pen.fillRect(0, 0, w, LANE);
      pen.fillRect(0, LANE + GAP, w, h - LANE - GAP);
      bins.first.forEach((_, k) => {
        const [x, wide] = bar(k, w);
        if (camera.unexplained[k]) {
          pen.fillStyle = ink("unknown");
          pen.fillRect(x, 0, wide, 5);
          pen.globalAlpha = 0.25;
          pen.fillRect(x, 5, wide, LANE - 5);
          pen.globalAlpha = 1;
        }
        const tall = farthest > 0 ? camera.shift[k] / farthest * (LANE - 6) : 0;
        pen.fillStyle = ink("moved");
        pen.fillRect(x, LANE - tall, wide, tall);
        const left = camera.residual[k] / largest * (h - LANE - GAP);
        pen.fillStyle = ink("faint");
        pen.fillRect(x, h - left, wide, left);
      });
      // Above all else: a bar may be narrower than a pixel.
      pen.fillStyle = ink("ink");
      bins.first.forEach((_, k) => {
        if (camera.cuts[k]) pen.fillRect(Math.min(bar(k, w)[0], w - 2), 0, 2, h);
      });
    });
  }
  const label = (position) => frames.time ? `${frames.frame[position]} (${when(position)})` : String(frames.frame[position]);
  if (count) {
    $("from").textContent = label(0);
    $("to").textContent = label(count - 1);
    $("highest").textContent = `highest bar${camera ? "s" : ""}: ${number(most)} a frame${camera ? `, ${farthest.toFixed(2)} px` : ""}`;
  }

  chart($("paths"), (pen, w, h) => {
    const scale = w / width;
    const backdrop = new Image();
    const paint = () => {
      pen.clearRect(0, 0, w, h);
      if (backdrop.complete && backdrop.naturalWidth) {
        pen.globalAlpha = 0.45;
        pen.drawImage(backdrop, 0, 0, w, h);
        pen.globalAlpha = 1;
      }
      if (border) {
        pen.save();
        pen.scale(scale, scale);
        const line = new Path2D(border);
        for (const [stroke, wide] of [["rgba(0, 0, 0, 0.3)", 2.5], ["rgba(255, 255, 255, 0.75)", 1]]) {
          pen.strokeStyle = stroke;
          pen.lineWidth = wide / scale;
          pen.stroke(line);
        }
        pen.restore();
      }
      pen.lineJoin = "round";
      for (const track of [...tracks].reverse()) {
        pen.globalAlpha = track.best < least ? 0.3 : 1;
        pen.beginPath();
        track.x.forEach((x, k) => pen.lineTo((x + 0.5) * scale, (track.y[k] + 0.5) * scale));
        pen.strokeStyle = "rgba(0, 0, 0, 0.5)";
        pen.lineWidth = 3.5;
        pen.stroke();
        pen.strokeStyle = colour(track.track);
        pen.lineWidth = 1.5;
        pen.stroke();
        const last = track.x.length - 1;
        pen.beginPath();
        pen.arc((track.x[last] + 0.5) * scale, (track.y[last] + 0.5) * scale, 2.5, 0, 7);
        pen.fillStyle = colour(track.track);
        pen.fill();
      }
      pen.globalAlpha = 1;
    };
    backdrop.onload = paint;
    if (thumbnails.image.length) backdrop.src = thumbnails.image[thumbnails.image.length >> 1];
    paint();
  });

  for (const histogram of data.histograms) {
    const box = element("div");
    const canvas = element("canvas", undefined, {
      role: "img",
      "aria-label": `Number of detections by ${histogram.name}, from 1e${histogram.from} on${histogram.marks.map((m) => `; ${m.text}: ${number(m.value)}`).join("")}`,
    });
    const words = histogram.marks.map((mark) => `Line: ${mark.text}, ${number(mark.value)}.`).join(" ");
    const about = element("p", `Detections by ${histogram.name}; both axes are logarithmic. ${words}`, { class: "note" });
    box.append(canvas, about);
    $("histograms").append(box);
    chart(canvas, (pen, w, h, ink) => {
      const { from, step, counts, marks: lines } = histogram;
      const low = Math.min(from, ...lines.map((m) => Math.log10(m.value))), high = Math.max(from + step * counts.length, ...lines.map((m) => Math.log10(m.value) + step));
      const [left, bottom, top] = [44, h - 34, 10];
      const x = (value) => left + (w - left - 8) * (value - low) / (high - low);
      const most = Math.log10(1 + Math.max(...counts));
      const y = (n) => bottom - (bottom - top) * Math.log10(1 + n) / most;
      pen.fillStyle = ink("faint");
      pen.strokeStyle = ink("line");
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      let above = Infinity;
      for (const n of [0, 1, 10, 100, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8]) {
        if (n > Math.max(...counts) || above - y(n) < 16) continue;
        above = y(n);
        pen.beginPath();
        pen.moveTo(left, Math.round(above) + 0.5);
        pen.lineTo(w - 8, Math.round(above) + 0.5);
        pen.stroke();
        pen.fillText(n >= 1e4 ? n.toExponential(0).replace("+", "") : String(n), left - 6, above);
      }
      pen.textAlign = "center";
      pen.textBaseline = "top";
      const decades = Math.max(1, Math.ceil((high - low) / Math.max(1, (w - left) / 60)));
      const fine = high - low < 2.5;
      for (let power = Math.floor(low); power <= high; power += decades) {
        for (const factor of fine ? [1, 2, 5] : [1]) {
          const at = power + Math.log10(factor);
          if (at < low - 1e-9 || at > high + 1e-9) continue;
          const text = power < -3 ? `${factor}e${power}` : number(factor * 10 ** power);
          pen.fillText(text, Math.min(x(at), w - 16), bottom + 5);
        }
      }
      pen.fillText(histogram.name, (left + w) / 2, bottom + 19);
      pen.fillStyle = ink("accent");
      counts.forEach((n, k) => {
        if (n) pen.fillRect(x(from + step * k) + 0.5, y(n), Math.max(1, x(from + step) - x(from) - 1), bottom - y(n));
      });
      pen.strokeStyle = ink("mark");
      pen.lineWidth = 2;
      for (const mark of lines) {
        pen.beginPath();
        pen.moveTo(x(Math.log10(mark.value)), top - 4);
        pen.lineTo(x(Math.log10(mark.value)), bottom);
        pen.stroke();
      }
    });
  }
  if (!data.histograms.length) $("histograms").append(element("p", "Nothing was found.", { class: "note" }));

  // Table of tracks.
  const rows = strong.slice(0, TABLE).map((track) => {
    const row = element("tr");
    const [from, to] = [track.frame[0], track.frame[track.frame.length - 1]];
    const button = element("button", String(track.track), { type: "button", "aria-label": `Track ${track.track}: show it`, title: "Show it" });
    button.prepend(dot(track.track));
    button.addEventListener("click", () => {
      pause();
      show(nearest(frames.frame, (from + to) / 2));
      viewer.scrollIntoView();
    });
    const name = element("td");
    name.append(button);
    const at = (frame, time) => time === undefined ? String(frame) : `${frame} (${time.toFixed(2)} s)`;
    row.append(name, ...[
      at(from, track.times?.[0]), at(to, track.times?.[1]), plural(track.confirmed, "frame"), track.speed.toFixed(2), number(track.best),
    ].map((text) => element("td", text)));
    return row;
  });
  $("tracks").tBodies[0].append(...rows);
  $("tracks").hidden = !rows.length;
  const words = [];
  if (!tracks.length) words.push("No track was confirmed.");
  else {
    words.push(`${plural(tracks.length, "track")}; a dot is where one ends.`);
    if (strong.length < tracks.length) {
      words.push(`${(tracks.length - strong.length).toLocaleString("en")} with less than ${100 * data.weak} % of the best score are drawn faintly.`);
    }
    if (rows.length < strong.length) words.push(`The ${TABLE} that were seen best and longest are listed.`);
  }
  $("paths-note").textContent = words.join(" ");

  // Playing, at the pace of the source.
  const span = frames.time && count > 1 ? (frames.time[count - 1] - frames.time[0]) / (count - 1) : frames.every / (data.rate ?? 25);
  const interval = span > 0 ? span : 0.04;
  let before = 0, owed = 0;
  const tick = (now) => {
    if (!playing) return;
    owed += Math.min(1, (now - before) / 1000) * Number($("pace").value) / interval;
    before = now;
    const steps = Math.floor(owed);
    // Who asked for little motion sees two pictures a second.
    if (steps > 0 && (!calm.matches || owed >= 0.5 * Number($("pace").value) / interval)) {
      owed -= steps;
      show(index + steps);
      if (index === count - 1) pause();
    }
    requestAnimationFrame(tick);
  };
  const pause = () => {
    playing = false;
    $("play").textContent = "Play";
    $("play").setAttribute("aria-pressed", "false");
  };
  const play = () => {
    if (playing) return pause();
    if (index === count - 1) show(0);
    playing = true;
    owed = 0;
    before = performance.now();
    $("play").textContent = "Pause";
    $("play").setAttribute("aria-pressed", "true");
    requestAnimationFrame(tick);
  };

  const step = (by) => { pause(); show(index + by); };
  const tenth = Math.max(1, Math.round(count / 10));
  $("first").addEventListener("click", () => step(-count));
  $("last").addEventListener("click", () => step(count));
  $("back").addEventListener("click", () => step(-1));
  $("next").addEventListener("click", () => step(1));
  $("play").addEventListener("click", play);
  slider.addEventListener("input", () => { pause(); show(Number(slider.value)); });
  for (const id of ["trails", "faint"]) $(id).addEventListener("change", () => show(index));
  const timeline = $("timeline").parentElement;
  const scrub = (event) => {
    const box = timeline.getBoundingClientRect();
    pause();
    show(nearest(frames.frame, first + (end - first) * (event.clientX - box.left) / box.width - 0.5));
  };
  timeline.addEventListener("pointerdown", (event) => { timeline.setPointerCapture(event.pointerId); scrub(event); });
  timeline.addEventListener("pointermove", (event) => { if (timeline.hasPointerCapture(event.pointerId)) scrub(event); });
  document.addEventListener("keydown", (event) => {
    const { key, target } = event;
    if (event.ctrlKey || event.altKey || event.metaKey || target.tagName === "SELECT") return;
    const inside = viewer.contains(target);
    if (!inside && target !== document.body) return;
    const far = event.shiftKey ? 10 : 1;
    const onSlider = target === slider;
    if (key === "ArrowLeft" || (onSlider && key === "ArrowDown")) step(-far);
    else if (key === "ArrowRight" || (onSlider && key === "ArrowUp")) step(far);
    else if (inside && key === "PageUp") step(tenth);
    else if (inside && key === "PageDown") step(-tenth);
    else if (inside && key === "Home") step(-count);
    else if (inside && key === "End") step(count);
    else if (key === " " && target.tagName !== "BUTTON" && target.type !== "checkbox") play();
    else return;
    event.preventDefault();
  });

  // A picture is as large as the page allows, and no higher than what can be seen at once.
  const screen = $("screen");
  screen.style.aspectRatio = `${width} / ${height}`;
  screen.style.maxWidth = `min(100%, max(16rem, ${(70 * width / height).toFixed(2)}vh))`;
  $("paths").style.aspectRatio = `${width} / ${height}`;
  marks.setAttribute("viewBox", `0 0 ${width} ${height}`);
  slider.max = String(count - 1);
  if (frames.camera) $("caption").classList.add("follows");
  if (count) show(0);
})();
