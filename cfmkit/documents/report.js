"use strict";
(() => {
  const data = document.getElementById("film-data");
  const slider = document.getElementById("pose");
  if (!data || !slider) return;
  const { texts, cursors } = JSON.parse(data.textContent);
  const poses = [...document.querySelectorAll(".pose")];
  const lines = [...document.querySelectorAll(".cursor")];
  const moment = document.getElementById("moment");
  const button = document.getElementById("play");
  let timer = 0;
  const show = (number) => {
    for (const pose of poses) pose.classList.toggle("now", Number(pose.dataset.pose) === number);
    lines.forEach((line, panel) => {
      line.setAttribute("x1", cursors[panel][number]);
      line.setAttribute("x2", cursors[panel][number]);
    });
    moment.textContent = texts[number];
    slider.setAttribute("aria-valuetext", texts[number]);
  };
  const stop = () => { clearInterval(timer); timer = 0; button.textContent = "play"; };
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  button.addEventListener("click", () => {
    if (timer) { stop(); return; }
    button.textContent = "stop";
    timer = setInterval(() => {
      slider.value = (Number(slider.value) + 1) % texts.length;
      show(Number(slider.value));
    }, 120);
  });
  document.documentElement.classList.add("moved");
  show(0);
})();
