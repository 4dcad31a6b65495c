for (const input of document.querySelectorAll(".slider input"))
  input.addEventListener("input", () => input.closest(".slider").querySelector(".stack").style.setProperty("--cut", input.value + "%"));
