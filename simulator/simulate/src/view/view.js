"use strict";

/* The page of `simulate view`: the program that served it runs the scene. */

Report.end = function (error) {
  const lost = error instanceof TypeError;
  const ended = document.getElementById("ended");
  ended.textContent = lost ? "simulate has ended. Start it again, and open the address that it prints." : `${error.message.trim()}. Reload this page to take it over.`;
  ended.hidden = false;
};

Report.ask = async function (kind, request) {
  const response = await fetch(kind, { method: "POST", ...(request && { body: JSON.stringify(request) }) });
  if (!response.ok) throw new Error(await response.text());
  return response;
};

Report.start = async function () {
  try {
    const data = await (await Report.ask("open")).json();
    data.scene.fixed = data.fixed;
    document.title = `${data.name} – simulate view`;
    document.getElementById("name").textContent = data.name;
    document.getElementById("description").textContent = data.description ?? "";
    const frame = async (request) => (await Report.ask("frame", request)).arrayBuffer();
    Report.live = new Report.Live(document.getElementById("live"), data, frame);
  } catch (error) {
    Report.end(error instanceof TypeError ? error : new Error(`The scene could not be opened: ${error.message}`));
    throw error;
  }
};
Report.start();
